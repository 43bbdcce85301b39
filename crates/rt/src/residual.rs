//! Residual monitor: whether the measured position answers the current.
//!
//! ```text
//!  applied current u --> plant model --> y_plant ---+--> low-pass of y - y_plant     open and closed loop
//!                                                   |
//!  reference r --> model of the closed loop --> y_loop --> y - y_loop, y_plant - y_loop      closed loop
//! ```
//!
//! The models are the nominal ones and start at rest; y is the position relative to that of the first tick. A residual e of a
//! predicted position y_p trips if
//!
//! |e| > a + b max |y_p|
//!
//! where the maximum decays with twice the time constant of the slowest mode, a = `interlock.model_error_ratio` times
//! `interlock.soft_limit_m`, and b = `interlock.model_error_share`, 1/2 if absent.
//!
//! - **Plant.** A lightly damped mode whose frequency is uncertain by its own half-power bandwidth makes a residual of up to twice
//!   its response: the full residual proves nothing near a mode. The low-pass consists of two first-order sections at half the
//!   frequency of the first mode, with a gain of 1/(1 + 2^2) = 1/5 there. A residual of twice the response is thus at most
//!   2/5 of it, and b = 1/2. At low frequency the static compliance decides: a position that does not move (detached probe, lost
//!   cable) trips at y_plant = 2 a, a reversed one at 2/3 a. Residuals of high modes, also of unmodelled ones, do not pass.
//! - **Closed loop.** Both residuals pass the same low-pass at twice the frequency of the last modelled mode: above it, modes that
//!   are not modelled answer, and the model proves nothing. An oscillation at a modelled mode passes with at least 4/5. Feedback
//!   makes y insensitive to the plant below the crossover, so y - y_loop is small there, and the current must be the one that
//!   moves the modelled plant along y_loop. Around and above the crossover T(D) differs, and the static compliance may: hence 0.4 b,
//!   a fifth of the largest predicted position. An oscillation that grows leaves y_loop.
//! - **Closed loop without prediction.** In a loop that is unstable by the model y_loop is the reference, with 0.4 b: what leaves it
//!   is the oscillation. With a law that is not linear y_loop is the reference, with 2 b: 1 allows an overshoot of 100 %.
//!
//! A free body (a mode of 0 Hz) drifts without limit after the smallest error of the force; its plant residual is not evaluated.

use super::arming::Trip;
use super::program::Decision;
use bench_base::numeric::is_within;
use bench_config::CLOSED_SHARE_FACTOR;
use bench_control::{ControlLaw, LawInput};
use bench_plant::{LoopPlant, LoopPlantState, Mode};

/// Factor of the share where the reference replaces the prediction, because the law is not linear.
const NOT_LINEAR_FACTOR: f64 = 2.0;
/// Corner frequency of the low-pass over the frequency of the first mode.
const CORNER_RATIO: f64 = 0.5;
/// Corner frequency of the low-pass of the closed loop over the frequency of the last mode.
const CLOSED_CORNER_RATIO: f64 = 2.0;
/// Longest and shortest time constant of the decay of the largest predicted position, in seconds.
const DECAY_S: (f64, f64) = (0.1, 1000.0);
/// Missed ticks that the model makes up for. More than this within a second trips in every profile.
const MAX_MISSED: u32 = 1000;

/// The prediction of a closed loop.
pub enum LoopPrediction {
    /// By the model of the closed loop, with a law at rest.
    Model(Box<dyn ControlLaw>),
    /// The reference: the loop is unstable by the model, so that an oscillation will grow.
    Unstable,
    /// The reference: the law is not linear.
    NotLinear,
}

/// The largest permitted residual: an absolute bound, and a share of the largest predicted position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ResidualBound {
    /// a in metres.
    pub absolute_m: f64,
    /// b.
    pub share: f64,
}

/// The monitor of a run. Without [`Residuals::closed_by`] it evaluates the residual of the plant only.
pub struct Residuals {
    bound: ResidualBound,
    plant: Predicted,
    low_pass: Option<LowPass>,
    /// At rest, for the residuals of the closed loop.
    closed_low_pass: LowPass,
    closed: Option<Closed>,
    rest_m: Option<f64>,
    applied_a: f64,
}

/// The plant model with its state, and its largest position.
struct Predicted {
    model: LoopPlant,
    state: LoopPlantState,
    position_m: f64,
    peak: Peak,
}

/// A decaying maximum of magnitudes in metres.
#[derive(Clone, Copy, Debug)]
struct Peak {
    decay: f64,
    value_m: f64,
}

/// Two equal first-order sections.
#[derive(Clone, Copy, Debug)]
struct LowPass {
    share: f64,
    states_m: [f64; 2],
}

/// The prediction of the closed loop.
struct Closed {
    prediction: LoopPrediction,
    plant: Predicted,
    /// For the residuals of the measured position and of the modelled plant.
    low_passes: [LowPass; 2],
    reference_m: f64,
    applied_a: f64,
    is_active: bool,
}

/// A modelled position, the difference of another one from it, and the bound of the difference, in metres.
struct Residual {
    modelled_m: f64,
    error_m: f64,
    limit_m: f64,
}

impl Residuals {
    /// The monitor of a plant with these modes.
    pub fn new(plant: LoopPlant, modes: &[Mode], bound: ResidualBound) -> Residuals {
        let period_s = plant.period_s();
        let decay = decay(modes, period_s);
        Residuals {
            bound,
            plant: Predicted::new(plant, decay),
            low_pass: first_rad_s(modes).map(|rad_s| LowPass::new(CORNER_RATIO * rad_s, period_s)),
            closed_low_pass: LowPass::new(CLOSED_CORNER_RATIO * last_rad_s(modes), period_s),
            closed: None,
            rest_m: None,
            applied_a: 0.0,
        }
    }

    /// The monitor of a closed loop.
    pub fn closed_by(mut self, prediction: LoopPrediction) -> Residuals {
        let model = self.plant.model.clone();
        self.closed = Some(Closed {
            prediction,
            plant: Predicted::new(model, self.plant.peak.decay),
            low_passes: [self.closed_low_pass; 2],
            reference_m: 0.0,
            applied_a: 0.0,
            is_active: false,
        });
        self
    }

    /// Begins a run: the models are at rest. Runs in the tick: must not allocate or block.
    pub(super) fn begin(&mut self) {
        (self.rest_m, self.applied_a) = (None, 0.0);
        self.plant.clear();
        if let Some(low_pass) = &mut self.low_pass {
            low_pass.states_m = [0.0; 2];
        }
        if let Some(closed) = &mut self.closed {
            closed.begin();
        }
    }

    /// Checks the position of a tick of a run. Runs in the tick: must not allocate or block.
    pub(super) fn check(&mut self, position_m: f64, missed: u32) -> Result<(), Trip> {
        for _ in 0..missed.min(MAX_MISSED) {
            self.advance();
        }
        let moved_m = position_m - *self.rest_m.get_or_insert(position_m);
        let plant_m = self.plant.position_m;
        self.check_plant(moved_m, plant_m)?;
        match &mut self.closed {
            Some(closed) if closed.is_active => closed.check(moved_m, plant_m, self.bound),
            Some(_) | None => Ok(()),
        }
    }

    fn check_plant(&mut self, moved_m: f64, plant_m: f64) -> Result<(), Trip> {
        let Some(low_pass) = &mut self.low_pass else {
            return Ok(());
        };
        let residual = Residual {
            modelled_m: plant_m,
            error_m: low_pass.next(moved_m - plant_m),
            limit_m: self.bound.limit_m(&self.plant.peak),
        };
        residual.check()
    }

    /// Takes the decision of a tick, its factor of the loop gain, and the current that it gave. Runs in the tick: must not
    /// allocate or block.
    pub(super) fn record(&mut self, decision: &Decision, gain: f64, applied_a: f64) {
        self.applied_a = applied_a;
        if let (Some(closed), Some(rest_m)) = (&mut self.closed, self.rest_m) {
            closed.record(decision, gain, rest_m);
        }
        self.advance();
    }

    fn advance(&mut self) {
        self.plant.advance(self.applied_a);
        if let Some(closed) = &mut self.closed {
            closed.plant.advance(closed.applied_a);
        }
    }
}

impl Closed {
    fn begin(&mut self) {
        (self.reference_m, self.applied_a, self.is_active) = (0.0, 0.0, false);
        self.plant.clear();
        for low_pass in &mut self.low_passes {
            low_pass.states_m = [0.0; 2];
        }
        if let LoopPrediction::Model(law) = &mut self.prediction {
            law.reset(0.0);
        }
    }

    /// Checks the measured position, and the one that the applied current gives by the model of the plant.
    fn check(&mut self, moved_m: f64, plant_m: f64, bound: ResidualBound) -> Result<(), Trip> {
        let (modelled_m, bound) = match self.prediction {
            LoopPrediction::Model(_) => (self.plant.position_m, bound.scaled(CLOSED_SHARE_FACTOR)),
            LoopPrediction::Unstable => (self.reference_m, bound.scaled(CLOSED_SHARE_FACTOR)),
            LoopPrediction::NotLinear => (self.reference_m, bound.scaled(NOT_LINEAR_FACTOR)),
        };
        let limit_m = bound.limit_m(&self.plant.peak);
        for (position_m, low_pass) in [moved_m, plant_m].into_iter().zip(&mut self.low_passes) {
            let residual = Residual {
                modelled_m,
                error_m: low_pass.next(position_m - modelled_m),
                limit_m,
            };
            residual.check()?;
        }
        Ok(())
    }

    /// The law of the model closes with the law of the loop, with the same feedforward current. The ramps at the end of the run are not predicted.
    fn record(&mut self, decision: &Decision, gain: f64, rest_m: f64) {
        self.is_active = decision.active;
        if !decision.active {
            return;
        }
        self.reference_m = decision.reference_m - rest_m;
        match &mut self.prediction {
            LoopPrediction::Model(law) => {
                let input = LawInput {
                    reference_m: self.reference_m,
                    position_m: self.plant.position_m,
                    applied_a: self.applied_a,
                };
                self.applied_a = law.update(&input.with_gain(gain)) + decision.feedforward_a;
            }
            LoopPrediction::Unstable | LoopPrediction::NotLinear => {
                self.plant.peak.add(self.reference_m);
            }
        }
    }
}

impl ResidualBound {
    fn limit_m(&self, peak: &Peak) -> f64 {
        self.absolute_m + self.share * peak.value_m
    }

    fn scaled(self, factor: f64) -> ResidualBound {
        ResidualBound {
            share: factor * self.share,
            ..self
        }
    }
}

impl Predicted {
    fn new(model: LoopPlant, decay: f64) -> Predicted {
        Predicted {
            state: model.at_rest(),
            model,
            position_m: 0.0,
            peak: Peak {
                decay,
                value_m: 0.0,
            },
        }
    }

    fn clear(&mut self) {
        self.state.clear();
        (self.position_m, self.peak.value_m) = (0.0, 0.0);
    }

    fn advance(&mut self, applied_a: f64) {
        self.model.step(&mut self.state, applied_a);
        self.position_m = self.model.reading_m(&self.state);
        self.peak.fade();
        self.peak.add(self.position_m);
    }
}

impl Peak {
    fn fade(&mut self) {
        self.value_m *= self.decay;
    }

    fn add(&mut self, position_m: f64) {
        self.value_m = self.value_m.max(position_m.abs());
    }
}

impl LowPass {
    fn new(corner_rad_s: f64, period_s: f64) -> LowPass {
        LowPass {
            share: 1.0 - libm::exp(-corner_rad_s * period_s),
            states_m: [0.0; 2],
        }
    }

    fn next(&mut self, input_m: f64) -> f64 {
        let [first_m, second_m] = &mut self.states_m;
        *first_m += self.share * (input_m - *first_m);
        *second_m += self.share * (*first_m - *second_m);
        *second_m
    }
}

impl Residual {
    fn check(&self) -> Result<(), Trip> {
        if is_within(self.error_m.abs(), self.limit_m) {
            Ok(())
        } else {
            Err(Trip::ModelError {
                error_m: self.error_m,
                modelled_m: self.modelled_m,
                limit_m: self.limit_m,
            })
        }
    }
}

/// Frequency of the slowest mode; `None` with a free body.
fn first_rad_s(modes: &[Mode]) -> Option<f64> {
    let first = modes.iter().map(|mode| mode.omega_rad_s).reduce(f64::min);
    first.filter(|rad_s| *rad_s > 0.0)
}

/// Frequency of the fastest mode; infinite without modes.
fn last_rad_s(modes: &[Mode]) -> f64 {
    let last = modes.iter().map(|mode| mode.omega_rad_s).reduce(f64::max);
    last.filter(|rad_s| *rad_s > 0.0).unwrap_or(f64::INFINITY)
}

/// Factor of the decay over a period: twice the time constant of the slowest decay of the modes.
fn decay(modes: &[Mode], period_s: f64) -> f64 {
    let rates = modes
        .iter()
        .map(|mode| mode.damping_ratio * mode.omega_rad_s);
    let slowest = rates.reduce(f64::min).unwrap_or(0.0);
    let (shortest_s, longest_s) = DECAY_S;
    let time_constant_s = (2.0 / slowest).max(shortest_s).min(longest_s);
    libm::exp(-period_s / time_constant_s)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(omega_rad_s: f64, damping_ratio: f64) -> Mode {
        Mode {
            omega_rad_s,
            damping_ratio,
            shape: nalgebra::DVector::zeros(1),
            force_gain: 1.0,
            sensor_gain: 1.0,
            floor_gain: 0.0,
        }
    }

    #[test]
    fn low_passes_follow_the_first_and_the_last_mode() {
        let modes = [mode(60.0, 0.01), mode(30.0, 0.02), mode(500.0, 0.005)];
        assert_eq!(first_rad_s(&modes), Some(30.0));
        assert_eq!(last_rad_s(&modes), 500.0);
    }

    #[test]
    fn a_free_body_has_no_plant_residual_and_no_last_mode() {
        let free = [mode(0.0, 0.0)];
        assert_eq!(first_rad_s(&free), None);
        assert_eq!(first_rad_s(&[]), None);
        assert_eq!([last_rad_s(&free), last_rad_s(&[])], [f64::INFINITY; 2]);
    }

    /// exp(-T/tau) with tau = 2/(zeta omega) of the slowest mode, between 0.1 s and 1000 s.
    #[test]
    fn maximum_decays_with_twice_the_longest_time_constant() {
        let period_s: f64 = 1e-3;
        for (modes, time_constant_s) in [
            (vec![mode(100.0, 0.01), mode(50.0, 0.01)], 4.0),
            (vec![mode(1e4, 0.5)], 0.1),
            (vec![mode(0.0, 0.0), mode(50.0, 0.01)], 1000.0),
            (vec![], 1000.0),
        ] {
            let expected = (-period_s / time_constant_s).exp();
            let decayed = decay(&modes, period_s);
            assert!((decayed - expected).abs() < 1e-15, "{decayed} {expected}");
        }
    }

    #[test]
    fn peak_fades_and_rises() {
        let mut peak = Peak {
            decay: 0.5,
            value_m: 0.0,
        };
        peak.add(-8.0);
        peak.fade();
        peak.add(1.0);
        assert_eq!(peak.value_m, 4.0);
        let bound = ResidualBound {
            absolute_m: 1.0,
            share: 0.5,
        };
        assert_eq!(bound.limit_m(&peak), 3.0);
        assert_eq!(bound.scaled(0.5).limit_m(&peak), 2.0);
    }
}
