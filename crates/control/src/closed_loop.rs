//! A loop of plant, amplifier, hold, delay and control law: its response, its poles, its step.

use std::sync::OnceLock;

use nalgebra::Complex;

use super::Section;
use super::controller::continuous_response;
use super::encirclements::{CurvePoint, refined, turn_rad, unstable_poles};
use super::error::ControllerError;
use super::features;
use super::law::{ControlDesign, LawInput, LinearLaw, OpenLoopPoles};
use super::margins::{Known, Margins, grid, margins};
use super::state_space::StateSpace;
use bench_base::units::UM_PER_M;
use bench_excitation::command::LoopCommand;
use bench_plant::{LoopPlant, Mode};

/// A closed loop, for the computation of its responses, poles, margins and step.
pub struct ClosedLoop {
    modes: Vec<Mode>,
    force_constant_n_per_a: f64,
    plant: LoopPlant,
    design: Box<dyn ControlDesign>,
    linear: Box<dyn LinearLaw>,
    /// Poles of the sampled closed loop, once they are computed.
    poles: OnceLock<Option<Vec<Complex<f64>>>>,
    /// The Nyquist curve of a law without matrices, once it is computed.
    curve: OnceLock<Option<Vec<CurvePoint>>>,
}

/// Upper end of the grid as a ratio of half the rate, where L is real.
const HIGHEST: f64 = 1.0 - 1e-9;
/// Lowest frequency of the grid as a ratio of half the rate: poles closer to 1 are not told apart from an integrator.
const LEAST_PART: f64 = 1e-9;
/// Points of the Nyquist curve for each peak of a delay line, before it is refined.
const POINTS_PER_PEAK: usize = 8;
/// The curve begins where |L| of a loop with integrators is at least this ...
const LARGE_LOOP_GAIN: f64 = 100.0;
/// ... and at most this many decades below the lowest frequency of interest.
const DECADES_BELOW: i32 = 12;

/// A mode in the response of a closed loop to a step of its reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepMode {
    /// Natural frequency in rad/s.
    pub omega_rad_s: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Amplitude over the height of the step, at the time of the step.
    pub step_ratio: f64,
}

impl ClosedLoop {
    /// The loop of a control law around `plant`, which is hold, amplifier, delays and probe around `modes`.
    ///
    /// # Errors
    /// The law offers no [`LinearLaw`].
    pub fn new(
        plant: LoopPlant,
        modes: Vec<Mode>,
        force_constant_n_per_a: f64,
        design: Box<dyn ControlDesign>,
    ) -> Result<ClosedLoop, ControllerError> {
        let linear = design
            .law(plant.period_s())
            .linear()
            .ok_or(ControllerError::NotLinear)?;
        Ok(ClosedLoop {
            modes,
            force_constant_n_per_a,
            plant,
            design,
            linear,
            poles: OnceLock::new(),
            curve: OnceLock::new(),
        })
    }

    /// The loop of another control law around the same plant.
    ///
    /// # Errors
    /// The law offers no [`LinearLaw`].
    pub fn with_design(
        self,
        design: Box<dyn ControlDesign>,
    ) -> Result<ClosedLoop, ControllerError> {
        ClosedLoop::new(self.plant, self.modes, self.force_constant_n_per_a, design)
    }

    /// Hold, amplifier, modes, delays and the probe's rate.
    pub fn plant(&self) -> &LoopPlant {
        &self.plant
    }

    /// The modes of the mechanics.
    pub fn modes(&self) -> &[Mode] {
        &self.modes
    }

    /// P in metres per ampere at z = exp(j w T): hold, amplifier, modes, delays and the probe's rate.
    pub fn sampled_plant(&self, omega_rad_s: f64) -> Complex<f64> {
        self.plant.response(omega_rad_s)
    }

    /// C in amperes per metre at z = exp(j w T).
    pub fn law_response(&self, omega_rad_s: f64) -> Complex<f64> {
        self.linear.response(self.z(omega_rad_s))
    }

    /// L = P C of the sampled loop.
    pub fn sampled_loop(&self, omega_rad_s: f64) -> Complex<f64> {
        self.plant.response(omega_rad_s) * self.law_response(omega_rad_s)
    }

    /// The poles of plant and control law that are not stable. `None` if they cannot be computed.
    pub fn open_loop_poles(&self) -> Option<OpenLoopPoles> {
        let law = self.linear.open_loop_poles()?;
        let free_bodies = self.modes.iter().filter(|mode| mode.omega_rad_s == 0.0);
        Some(OpenLoopPoles {
            integrators: law.integrators + 2 * free_bodies.count(),
            ..law
        })
    }

    /// T = L/(1 + L) of the sampled loop, from reference to reading.
    pub fn complementary_sensitivity(&self, omega_rad_s: f64) -> Complex<f64> {
        let loop_gain = self.sampled_loop(omega_rad_s);
        loop_gain / (loop_gain + 1.0)
    }

    /// L = P C in continuous time, without hold, delay and amplifier; `None` for a law that was not designed as a
    /// cascade of continuous sections.
    pub fn continuous_loop(&self, omega_rad_s: f64) -> Option<Complex<f64>> {
        let sections = self.design.sections()?;
        Some(self.continuous_response(sections, omega_rad_s))
    }

    fn continuous_response(&self, sections: &[Section], omega_rad_s: f64) -> Complex<f64> {
        let s = Complex::new(0.0, omega_rad_s);
        let modes = self.modes.iter();
        let plant: Complex<f64> = modes
            .map(|mode| mode.resonance(s) * mode.residue_per_kg())
            .sum();
        plant * self.force_constant_n_per_a * continuous_response(sections, s)
    }

    /// Margins of the sampled loop, from 0 to half the rate.
    pub fn margins(&self) -> Margins {
        let nyquist_rad_s = self.nyquist_rad_s();
        let known = Known {
            grid_rad_s: &self.frequencies(self.lowest_change_rad_s(), HIGHEST * nyquist_rad_s),
            ends_rad_s: &[0.0, nyquist_rad_s],
            stable: self.is_stable(),
            continuous: false,
        };
        margins(&|w| self.sampled_loop(w), &known)
    }

    /// Margins in continuous time, without hold, delay and amplifier.
    ///
    /// # Errors
    /// The law was not designed as continuous sections.
    pub fn continuous_margins(&self) -> Result<Margins, ControllerError> {
        let sections = self.design.sections();
        let sections = sections.ok_or(ControllerError::NotSections)?;
        let highest = self.modes.last().map_or(1.0, |mode| mode.omega_rad_s);
        let high_rad_s = 10.0 * highest.max(self.nyquist_rad_s());
        let poles = self.poles_in_continuous_time(sections);
        let features = self.continuous_features(sections, poles.as_deref().unwrap_or_default());
        let known = Known {
            grid_rad_s: &grid(self.lowest_rad_s(), high_rad_s, &features),
            ends_rad_s: &[0.0],
            stable: poles.is_some_and(|poles| poles.iter().all(|pole| pole.re < 0.0)),
            continuous: true,
        };
        Ok(margins(&|w| self.continuous_response(sections, w), &known))
    }

    /// Frequencies in rad/s that follow every resonance of plant, controller and closed loop, also those that sampling moves below half
    /// the rate.
    pub fn frequencies(&self, low_rad_s: f64, high_rad_s: f64) -> Vec<f64> {
        let mut frequencies = grid(low_rad_s, high_rad_s, &self.features());
        if let Some(curve) = self.curve() {
            let on_curve = curve.iter().map(|point| point.rad_s);
            frequencies.extend(on_curve.filter(|w| (low_rad_s..=high_rad_s).contains(w)));
            frequencies.sort_by(f64::total_cmp);
            frequencies.dedup();
        }
        frequencies
    }

    /// Reading (in metres, relative to the start) at each tick after a reference of `reference_m(tick)`: the linear loop
    /// from rest, without noise, disturbance and limits.
    pub fn simulate(&self, ticks: usize, reference_m: impl Fn(usize) -> f64) -> Vec<f64> {
        self.signals(ticks, reference_m)
            .map(|(_, position_m)| position_m)
            .collect()
    }

    /// Current in amperes and reading in metres of each tick of [`simulate`](Self::simulate). The reading is taken
    /// before the current.
    pub fn signals(
        &self,
        ticks: usize,
        reference_m: impl Fn(usize) -> f64,
    ) -> impl Iterator<Item = (f64, f64)> {
        self.commanded_signals(ticks, move |tick| LoopCommand {
            reference_m: reference_m(tick),
            feedforward_a: 0.0,
        })
    }

    /// As [`signals`](Self::signals), with a command that contains a feedforward current.
    pub fn commanded_signals(
        &self,
        ticks: usize,
        mut command: impl FnMut(usize) -> LoopCommand,
    ) -> impl Iterator<Item = (f64, f64)> {
        let mut law = self.design.law(self.plant.period_s());
        law.reset(0.0);
        let mut state = self.plant.at_rest();
        let mut applied_a = 0.0;
        (0..ticks).map(move |tick| {
            let position_m = self.plant.reading_m(&state);
            let command = command(tick);
            let input = LawInput {
                reference_m: command.reference_m,
                position_m,
                applied_a,
            };
            applied_a = command.added_to(law.update(&input));
            self.plant.step(&mut state, applied_a);
            (applied_a, position_m)
        })
    }

    /// The lightly damped modes with which the closed loop answers a step of its reference, the strongest first: those whose
    /// part of the response begins with at least `least_ratio` of the step and decays with less than half of critical damping.
    ///
    /// At a pole p of T = L/(1 + L) with the residue R, the part of the response to a unit step is 2 Re(R p^k/(p - 1)).
    pub fn step_modes(&self, least_ratio: f64) -> Vec<StepMode> {
        let poles = self.sampled_poles().unwrap_or_default();
        let pairs = poles.iter().filter(|z| z.im > 0.0);
        let mut modes: Vec<StepMode> = pairs
            .map(|z| self.step_mode(*z, poles))
            .filter(|mode| mode.damping_ratio < 0.5 && mode.step_ratio >= least_ratio)
            .collect();
        modes.sort_by(|a, b| b.step_ratio.total_cmp(&a.step_ratio));
        modes
    }

    fn step_mode(&self, z: Complex<f64>, poles: &[Complex<f64>]) -> StepMode {
        let pole = z.ln() / self.plant.period_s();
        let residue = self.residue(z, poles);
        StepMode {
            omega_rad_s: pole.norm(),
            damping_ratio: -pole.re / pole.norm(),
            step_ratio: 2.0 * (residue / (z - Complex::new(1.0, 0.0))).norm(),
        }
    }

    /// The residue of T at a pole, by Cauchy's integral on a circle that contains no other pole of T: with 16 points and a fifth of
    /// the distance to the next pole, the others add (1/5)^16 of their own. A pole of L alone is none of T.
    fn residue(&self, pole: Complex<f64>, poles: &[Complex<f64>]) -> Complex<f64> {
        let distances = poles.iter().map(|other| (other - pole).norm());
        let nearest = distances.filter(|distance| *distance > 0.0);
        let radius = 0.2 * nearest.fold(1.0, f64::min);
        let one = Complex::new(1.0, 0.0);
        let terms = (0..16).map(|point| {
            let arm = Complex::from_polar(radius, std::f64::consts::PI / 8.0 * f64::from(point));
            let around = pole + arm;
            let open = self.plant.response_at(around) * self.linear.response(around);
            (one - (one + open).inv()) * arm
        });
        terms.sum::<Complex<f64>>() / 16.0
    }

    fn z(&self, omega_rad_s: f64) -> Complex<f64> {
        let (sine, cosine) = libm::sincos(omega_rad_s * self.plant.period_s());
        Complex::new(cosine, sine)
    }

    /// Half the sampling rate, pi/T, in rad/s.
    pub fn nyquist_rad_s(&self) -> f64 {
        std::f64::consts::PI / self.plant.period_s()
    }

    /// The lowest frequency of the search for crossings in rad/s.
    pub fn lowest_rad_s(&self) -> f64 {
        let slowest = self.modes.iter().find(|mode| mode.omega_rad_s > 0.0);
        1e-3 * slowest
            .map_or(1.0, |mode| mode.omega_rad_s)
            .min(self.nyquist_rad_s())
    }

    /// Below this frequency in rad/s nothing changes: a tenth of the slowest pole or zero, of the closed loop too.
    fn lowest_change_rad_s(&self) -> f64 {
        let slowest = self.pairs().map(features::magnitude_rad_s);
        let slowest_rad_s = slowest.fold(f64::INFINITY, f64::min);
        let least_rad_s = LEAST_PART * self.nyquist_rad_s();
        self.lowest_rad_s()
            .min(0.1 * slowest_rad_s)
            .max(least_rad_s)
    }

    /// Frequency and damping ratio of each resonance and antiresonance of the sampled loop.
    fn features(&self) -> Vec<(f64, f64)> {
        features::distinct(self.pairs())
    }

    /// Frequency and damping ratio of the modes, of the roots of the law and of the poles of the closed loop, as they appear below half
    /// the rate.
    fn pairs(&self) -> impl Iterator<Item = (f64, f64)> {
        let period_s = self.plant.period_s();
        let modes = self.modes.iter().filter(|mode| mode.omega_rad_s > 0.0);
        let modes = modes
            .map(move |mode| features::alias((mode.omega_rad_s, mode.damping_ratio), period_s));
        let roots = self.linear.roots();
        let poles = self.sampled_poles().unwrap_or_default().iter().copied();
        let roots = roots.into_iter().chain(poles);
        modes.chain(roots.filter_map(move |z| features::of_root(z, period_s)))
    }

    /// The same of the loop in continuous time.
    fn continuous_features(&self, sections: &[Section], poles: &[Complex<f64>]) -> Vec<(f64, f64)> {
        let modes = self.modes.iter();
        let modes = modes.map(|mode| (mode.omega_rad_s, mode.damping_ratio));
        let poles = poles.iter().map(|s| (s.norm(), s.re.abs() / s.norm()));
        features::distinct(modes.chain(section_pairs(sections)).chain(poles))
    }

    /// Poles of the sampled closed loop in rad/s, s = ln(z)/T. Empty if they cannot be computed.
    pub fn poles(&self) -> Vec<Complex<f64>> {
        let period_s = self.plant.period_s();
        let poles = self.sampled_poles().unwrap_or_default();
        poles.iter().map(|z| z.ln() / period_s).collect()
    }

    /// Poles of the closed loop in continuous time in rad/s. Empty for a law that was not designed as continuous
    /// sections.
    pub fn continuous_poles(&self) -> Vec<Complex<f64>> {
        let sections = self.design.sections();
        let poles = sections.and_then(|sections| self.poles_in_continuous_time(sections));
        poles.unwrap_or_default()
    }

    fn sampled_poles(&self) -> Option<&[Complex<f64>]> {
        let poles = self.poles.get_or_init(|| {
            let (a, b, c) = self.plant.state_space();
            let plant = StateSpace { a, b, c, d: 0.0 };
            self.linear.state_space()?.then(&plant).closed_poles()
        });
        poles.as_deref()
    }

    fn poles_in_continuous_time(&self, sections: &[Section]) -> Option<Vec<Complex<f64>>> {
        let gain = StateSpace::gain(UM_PER_M);
        let law = sections.iter().fold(gain, |cascade, section| {
            cascade.then(&StateSpace::from(section))
        });
        let plant = StateSpace::of_modes(&self.modes, self.force_constant_n_per_a);
        law.then(&plant).closed_poles()
    }

    /// All poles of the sampled closed loop lie inside the unit circle. They are computed, or, for a law without matrices, counted by
    /// the encirclements of the Nyquist curve.
    pub fn is_stable(&self) -> bool {
        match self.sampled_poles() {
            Some(poles) => poles.iter().all(|pole| pole.norm() < 1.0),
            None => self.unstable_poles_of_curve() == Some(0),
        }
    }

    /// Number of unstable poles by the Nyquist curve of a law without matrices; `None` for other laws, and if the curve passes
    /// through -1.
    fn unstable_poles_of_curve(&self) -> Option<i64> {
        let (open, curve) = (self.open_loop_poles()?, self.curve()?);
        let turned_rad = turn_rad(curve.iter().map(|point| point.value));
        Some(unstable_poles(open, turned_rad))
    }

    /// The Nyquist curve of a law without matrices.
    fn curve(&self) -> Option<&[CurvePoint]> {
        let curve = self.curve.get_or_init(|| {
            if self.linear.state_space().is_some() {
                return None;
            }
            let high_rad_s = HIGHEST * self.nyquist_rad_s();
            let low_rad_s = self.asymptote_rad_s(self.lowest_change_rad_s())?;
            let mut frequencies = grid(low_rad_s, high_rad_s, &self.features());
            frequencies.extend(self.peaks_of_delay_rad_s(low_rad_s, high_rad_s));
            frequencies.sort_by(f64::total_cmp);
            refined(&|w| self.sampled_loop(w) + 1.0, &frequencies)
        });
        curve.as_deref()
    }

    /// The multiples of 1/N of the rate at which a delay line of N ticks may have a peak, with points between them.
    fn peaks_of_delay_rad_s(
        &self,
        low_rad_s: f64,
        high_rad_s: f64,
    ) -> impl Iterator<Item = f64> + use<> {
        let intervals = POINTS_PER_PEAK * self.linear.delay_ticks();
        let spacing_rad_s = 2.0 * self.nyquist_rad_s() / intervals.max(1) as f64;
        let multiples = (1..=intervals / 2).map(move |k| k as f64 * spacing_rad_s);
        multiples.filter(move |w| (low_rad_s..=high_rad_s).contains(w))
    }

    /// A frequency, not above the given one, below which the curve does not turn: with integrators, |L| is large there. `None` if the
    /// poles of the law are not known, or there is no such frequency.
    pub(super) fn asymptote_rad_s(&self, highest_rad_s: f64) -> Option<f64> {
        let has_integrator = self.open_loop_poles()?.integrators > 0;
        let decades = 0..=DECADES_BELOW;
        let mut candidates =
            decades.map(|decade| highest_rad_s * libm::pow(10.0, -f64::from(decade)));
        candidates.find(|w| !has_integrator || self.sampled_loop(*w).norm() >= LARGE_LOOP_GAIN)
    }
}

/// Frequency and damping ratio of the pairs of zeros and poles.
fn section_pairs(sections: &[Section]) -> Vec<(f64, f64)> {
    let polynomials = sections
        .iter()
        .flat_map(|section| [section.numerator, section.denominator]);
    polynomials.filter_map(|c| pair(&c)).collect()
}

fn pair([c0, c1, c2]: &[f64; 3]) -> Option<(f64, f64)> {
    let w = (c0 / c2).sqrt();
    (*c2 != 0.0 && w > 0.0).then(|| (w, (c1 / (2.0 * c2 * w)).abs()))
}

#[cfg(test)]
mod tests;
