//! Ticks that the loop missed: the positions in them are predicted by the fitted modes.
//!
//! The amplifier holds its set-point while ticks are missed, so that the input of the record is known exactly. Only positions are
//! unknown; they are estimated together with the modes (expectation maximisation; A. P. Dempster, N. M. Laird, D. B. Rubin, J. R. Stat.
//! Soc. B 39, 1977):
//!
//! ```text
//! positions on straight lines -> response -> modes -> positions by the modes -> response -> modes -> ...
//!
//! y_k = m_k + line through y - m of the ticks before and after the gap       m: positions by the modes
//! ```
//!
//! The line follows the disturbances of the stage, which are slow, and errors of the modes. Each round multiplies the error of the
//! positions by about the ratio p of missing ticks.
//!
//! The predicted positions add no information. With q the largest ratio of missing ticks in a window of the time in which the sweep
//! determines a mode, the variances of a response are those of its estimate times
//!
//! ```text
//! 1/((1 - p)(1 - q))        1 - p: the noise is estimated from a record of which the share p has none;  1 - q: fewer data
//! ```
//!
//! A mode is determined while it is swept through, in 2 zeta w/(2 pi r) at r Hz/s, or while it decays, in 1/(zeta w), whichever is longer.
//! The shortest of these times is 1/sqrt(pi r), for the mode with zeta w = sqrt(pi r).

use std::f64::consts::PI;

use super::analysis_error::AnalysisError;
use bench_config::Config;
use bench_excitation::Sweep;
use bench_identify::modal::ModalFit;
use bench_identify::{Frf, PHASE_SIGMA_LIMIT_RAD, Signals};
use bench_plant::{FAR_RAD_S, LoopPlant, Mode, SignalPath};

/// Largest ratio of missing ticks of a run: a round then reduces the error of the positions to about a twentieth.
pub(super) const MAX_RATIO: f64 = 0.05;
/// Largest ratio of missing ticks if positions stay on straight lines, which have an error of (w T)^2/2 of the amplitude, and of lost
/// records.
pub(super) const MAX_RATIO_ON_LINES: f64 = 1e-3;
/// Largest ratio of missing ticks of a run in closed loop: in a missed tick the loop is open, so that its margins and sensitivities differ
/// from those of the loop by about this ratio.
pub(super) const MAX_RATIO_OF_LOOP: f64 = 0.01;
/// Largest ratio of missing ticks in the shortest time that determines a mode: half of the data remain.
const MAX_RATIO_OF_WINDOW: f64 = 0.5;
/// Rounding of a product of a number of ticks and a ratio.
const ROUNDING: f64 = 1e-6;
/// Number of predictions with at most a ratio of [`MAX_RATIO_ON_LINES`] of single missed ticks: straight lines through them are nearly
/// right, and the first prediction removes their error.
const ROUNDS_OF_FEW: usize = 1;
/// Number of predictions with more single missed ticks.
const ROUNDS_OF_SINGLE: usize = 2;
/// Number of predictions with longer gaps. Straight lines through gaps of ten ticks are wrong by the whole amplitude, so that the first
/// fits have too many modes: the third one still changes the result.
const ROUNDS: usize = 4;

/// Missing ticks of the signals of a run.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MissingTicks {
    /// Their indices in the signals; they rise.
    pub(super) indices: Vec<usize>,
    /// Number of ticks of the signals, missing ones included.
    pub(super) ticks: usize,
}

impl MissingTicks {
    pub(super) fn count(&self) -> u64 {
        self.indices.len() as u64
    }

    /// Number of recorded ticks.
    pub(super) fn recorded(&self) -> usize {
        self.ticks.saturating_sub(self.indices.len())
    }

    pub(super) fn is_empty(&self) -> bool {
        self.indices.is_empty()
    }

    /// The ratio of missing ticks.
    fn ratio(&self) -> f64 {
        self.indices.len() as f64 / self.ticks.max(1) as f64
    }

    /// Number of predictions after which the positions no longer change.
    pub(super) fn rounds(&self) -> usize {
        let are_single = self.indices.windows(2).all(|pair| pair[0] + 1 < pair[1]);
        match (self.is_empty(), are_single) {
            (true, _) => 0,
            (false, true) if self.ratio() <= MAX_RATIO_ON_LINES => ROUNDS_OF_FEW,
            (false, true) => ROUNDS_OF_SINGLE,
            (false, false) => ROUNDS,
        }
    }

    /// Fails with more than a ratio of all ticks.
    pub(super) fn check_ratio(&self, max_ratio: f64) -> Result<(), AnalysisError> {
        check_ratio(self.count(), self.recorded() as u64, max_ratio)
    }

    /// Largest number of missing ticks among `window` successive ticks.
    fn most_within(&self, window: usize) -> usize {
        let mut first = 0;
        let counts = self.indices.iter().enumerate().map(|(last, index)| {
            while index - self.indices[first] >= window {
                first += 1;
            }
            last + 1 - first
        });
        counts.max().unwrap_or(0)
    }

    /// The factor by which missing ticks increase the variances of a response: see the module.
    pub(super) fn variance_factor(&self, window: usize) -> Result<f64, AnalysisError> {
        let missing = self.most_within(window);
        let ratio_of_window = missing as f64 / window as f64;
        if ratio_of_window > MAX_RATIO_OF_WINDOW {
            return Err(AnalysisError::DenseGaps {
                missing: missing as u64,
                window: window as u64,
                all: self.count(),
            });
        }
        Ok(1.0 / ((1.0 - self.ratio()) * (1.0 - ratio_of_window)))
    }

    /// Replaces the positions of missing ticks: the prediction, and on it a line through the errors of the prediction before and
    /// after the gap.
    fn predict(&self, position_m: &mut [f64], predicted_m: &[f64]) {
        for gap in self.indices.chunk_by(|a, b| a + 1 == *b) {
            // A gap is between two recorded ticks.
            let (before, after) = (gap[0] - 1, gap[gap.len() - 1] + 1);
            let [from_m, to_m] = [before, after].map(|k| position_m[k] - predicted_m[k]);
            for index in gap {
                let share = (index - before) as f64 / (after - before) as f64;
                position_m[*index] = predicted_m[*index] + from_m + share * (to_m - from_m);
            }
        }
    }

    /// Replaces the positions of missing ticks by those of fitted modes for the currents of the record, from rest.
    pub(super) fn predict_by(&self, fit: &ModalFit, path: &SignalPath, signals: &mut Signals) {
        let predicted_m = positions_m(fit, path, &signals.input);
        self.predict(&mut signals.output, &predicted_m);
    }
}

/// Fails with too many lost records beside recorded ones. The current in their ticks is not known: it is taken as held.
pub(super) fn check_lost(lost: u64, recorded: u64) -> Result<(), AnalysisError> {
    let allowed = allowed(recorded, MAX_RATIO_ON_LINES);
    if lost <= allowed {
        return Ok(());
    }
    Err(AnalysisError::LostRecords {
        lost,
        ticks: recorded,
        allowed,
    })
}

/// Number of missing ticks beside recorded ones at a ratio of all.
fn allowed(recorded: u64, max_ratio: f64) -> u64 {
    (recorded as f64 * max_ratio / (1.0 - max_ratio) + ROUNDING) as u64
}

/// Fails with more missing ticks beside recorded ones than a ratio of all.
pub(super) fn check_ratio(
    missing: u64,
    recorded: u64,
    max_ratio: f64,
) -> Result<(), AnalysisError> {
    let allowed = allowed(recorded, max_ratio);
    if missing <= allowed {
        return Ok(());
    }
    Err(AnalysisError::Gaps {
        missing,
        ticks: recorded,
        allowed,
    })
}

/// The positions of fitted modes, at the end of a signal path with readings of the mean age, for a command from rest.
fn positions_m(fit: &ModalFit, path: &SignalPath, command_a: &[f64]) -> Vec<f64> {
    let parameters = &fit.parameters;
    let far = mode(
        FAR_RAD_S,
        1.0,
        parameters.remainder_m_per_n * FAR_RAD_S * FAR_RAD_S,
    );
    let terms = parameters.modes.iter();
    let modes = terms.map(|term| mode(term.omega_rad_s, term.damping_ratio, term.residue_per_kg));
    let modes: Vec<Mode> = modes.chain([far]).collect();
    let path = path.with_mean_age().with_added_delay(parameters.delay_s);
    let plant = LoopPlant::of(&path, &modes);
    let mut state = plant.at_rest();
    let next = |command_a: &f64| {
        let position_m = plant.reading_m(&state);
        plant.step(&mut state, *command_a);
        position_m
    };
    command_a.iter().map(next).collect()
}

fn mode(omega_rad_s: f64, damping_ratio: f64, residue_per_kg: f64) -> Mode {
    Mode {
        sensor_gain: residue_per_kg,
        ..Mode::unit(omega_rad_s, damping_ratio)
    }
}

/// The shortest time, in ticks, in which a sweep over a band determines a mode: see the module. `duration_s` is that of the sweep.
pub(super) fn shortest_window(
    config: &Config,
    (low_hz, high_hz): (f64, f64),
    duration_s: f64,
) -> usize {
    let sweep_hz_per_s = match config.chirp.sweep {
        Sweep::Linear => (high_hz - low_hz) / duration_s,
        Sweep::Logarithmic => high_hz * libm::log(high_hz / low_hz) / duration_s,
    };
    let window_s = 1.0 / (PI * sweep_hz_per_s).sqrt();
    let ticks = (window_s.min(duration_s) * config.servo.rate_hz) as usize;
    ticks.max(1)
}

/// A response with its variances multiplied by a factor of 1 or more.
pub(super) fn with_variance_factor(mut frf: Frf, factor: f64) -> Frf {
    let root = factor.sqrt();
    for sigma in &mut frf.magnitude_sigma {
        *sigma *= root;
    }
    for sigma in &mut frf.phase_sigma_rad {
        *sigma = (*sigma * root).min(PHASE_SIGMA_LIMIT_RAD);
    }
    for datum in &mut frf.data {
        datum.variance *= factor;
    }
    frf
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_identify::modal::ModalParameters;
    use bench_plant::zeros::ModalTerm;
    use nalgebra::{Complex, DMatrix};

    const RATE_HZ: f64 = 1000.0;
    const COUNT: usize = 4000;

    fn term(hz: f64, damping_ratio: f64, residue_per_kg: f64) -> ModalTerm {
        ModalTerm {
            omega_rad_s: 2.0 * PI * hz,
            damping_ratio,
            residue_per_kg,
        }
    }

    fn modes() -> [ModalTerm; 2] {
        [term(29.0, 0.009, 0.5), term(85.0, 0.004, -0.03)]
    }

    /// A fit that has found exactly these modes.
    fn exact_fit(modes: &[ModalTerm]) -> ModalFit {
        ModalFit {
            parameters: ModalParameters {
                modes: modes.to_vec(),
                ..ModalParameters::default()
            },
            covariance: DMatrix::zeros(0, 0),
            orders: Vec::new(),
            one_more_mode: None,
            chi2_per_freedom: 1.0,
            freedom: 1000,
            band_hz: (1.0, 200.0),
            left_out_hz: Vec::new(),
        }
    }

    /// A path with one period of delay and no lag: 1/(2 pi 1e9 Hz) is 2e-10 s.
    fn path() -> SignalPath {
        SignalPath {
            period_s: 1.0 / RATE_HZ,
            amplifier_bandwidth_hz: 1e9,
            force_constant_n_per_a: 1.0,
            delays_s: vec![1.0 / RATE_HZ],
            output: bench_plant::OutputKind::Position,
        }
    }

    /// A sweep from 0 to 160 Hz.
    fn sweep_a() -> Vec<f64> {
        let phase = |t: f64| 2.0 * PI * 20.0 * t * t;
        (0..COUNT)
            .map(|k| phase(k as f64 / RATE_HZ).sin())
            .collect()
    }

    /// The displacement of a mode by a held force, one period later: with the pole p, x[k + 1] = e x[k] + (e - 1)/p u[k] with
    /// e = exp(p T), and the position r Im x/Im p.
    fn displacement_m(mode: &ModalTerm, force_n: &[f64]) -> Vec<f64> {
        let zeta = mode.damping_ratio;
        let pole = Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * mode.omega_rad_s;
        let step = (pole / RATE_HZ).exp();
        let mut x = Complex::new(0.0, 0.0);
        let delayed = std::iter::once(&0.0).chain(force_n);
        let next = |force: &f64| {
            let position_m = mode.residue_per_kg * x.im / pole.im;
            x = step * x + (step - 1.0) / pole * force;
            position_m
        };
        delayed.take(COUNT).map(next).collect()
    }

    fn missing(is_missing: impl Fn(usize) -> bool) -> MissingTicks {
        MissingTicks {
            indices: (0..COUNT).filter(|k| is_missing(*k)).collect(),
            ticks: COUNT,
        }
    }

    /// The largest error of the positions of missing ticks over the amplitude, with an offset of the probe.
    fn error_of_prediction(missing: &MissingTicks, offset_m: f64) -> f64 {
        let input = sweep_a();
        let mut truth_m = vec![offset_m; COUNT];
        for mode in &modes() {
            let moved_m = displacement_m(mode, &input);
            truth_m.iter_mut().zip(moved_m).for_each(|(y, m)| *y += m);
        }
        let mut signals = Signals {
            rate_hz: RATE_HZ,
            input,
            output: truth_m.clone(),
        };
        for index in &missing.indices {
            signals.output[*index] = 1.0;
        }
        missing.predict_by(&exact_fit(&modes()), &path(), &mut signals);
        let errors = signals.output.iter().zip(&truth_m);
        let largest = errors.map(|(y, t)| (y - t).abs()).fold(0.0, f64::max);
        largest / truth_m.iter().fold(0.0_f64, |peak, y| peak.max(y.abs()))
    }

    #[test]
    fn positions_of_missing_ticks_are_those_of_the_modes() {
        let singles = missing(|k| k % 97 == 50);
        let bursts = missing(|k| k % 500 < 10 && k >= 500);
        for missing in [singles, bursts] {
            // The lag of the amplifier is 2e-10 s: at 100 Hz 1e-7 of the amplitude. A position that is off by a tick has 0.1.
            let error = error_of_prediction(&missing, 0.0);
            assert!(error < 1e-6, "{error}");
            // An offset that the modes do not have is that of the neighbours.
            let error = error_of_prediction(&missing, 1e-5);
            assert!(error < 1e-6, "{error}");
        }
    }

    #[test]
    fn number_of_predictions_depends_on_the_longest_gap_and_the_ratio() {
        assert_eq!(missing(|_| false).rounds(), 0);
        assert_eq!(missing(|k| k == 7).rounds(), ROUNDS_OF_FEW);
        assert_eq!(missing(|k| k % 97 == 50).rounds(), ROUNDS_OF_SINGLE);
        assert_eq!(missing(|k| k == 7 || k == 8).rounds(), ROUNDS);
    }

    #[test]
    fn weight_is_that_of_the_densest_window() {
        // 40 missing ticks of 4000: single ones up to 2950, and a gap of ten from 3500 on. The 2000 ticks before 3510 have 15 and ten.
        let missing = missing(|k| (k % 100 == 50 && k < 3000) || (3500..3510).contains(&k));
        assert_eq!(missing.count(), 40);
        for (window, most) in [
            (1, 1),
            (10, 10),
            (100, 10),
            (101, 10),
            (700, 12),
            (2000, 25),
        ] {
            assert_eq!(missing.most_within(window), most, "{window}");
        }
        let factor = missing.variance_factor(100).expect("few");
        assert!((factor - 1.0 / (0.99 * 0.9)).abs() < 1e-12, "{factor}");
        assert!(missing.variance_factor(20).is_ok(), "half of a window");
        let error = missing.variance_factor(19).expect_err("more than half");
        assert!(error.to_string().contains("10 of 19 successive ticks"));
        assert!(error.to_string().contains("40 in the whole run"));
    }

    #[test]
    fn variances_of_a_response_are_multiplied() {
        let mut frf = Frf::default();
        frf.push(bench_identify::FrfPoint {
            frequency_hz: 10.0,
            response: Complex::new(1.0, 0.0),
            coherence: 1.0,
            variance: 2.0,
            resolution_hz: 1.0,
        });
        let wider = with_variance_factor(frf.clone(), 4.0);
        assert_eq!(wider.magnitude_sigma[0], 2.0 * frf.magnitude_sigma[0]);
        assert!(wider.phase_sigma_rad[0] <= PHASE_SIGMA_LIMIT_RAD);
        assert_eq!(wider.response, frf.response);
    }
}
