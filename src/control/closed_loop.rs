//! A loop of plant, amplifier, hold, delay and control law: its response, its poles, its step.

use nalgebra::Complex;

use super::controller::continuous_response;
use super::law::{ControlDesign, LawInput, LinearLaw};
use super::margins::{Margins, grid, margins};
use super::state_space::StateSpace;
use super::{ControllerError, Section};
use crate::model::plant::{LoopPlant, Mode};
use crate::util::units::UM_PER_M;

/// A closed loop, for the computation of its responses, poles, margins and step.
pub struct ClosedLoop {
    modes: Vec<Mode>,
    force_constant_n_per_a: f64,
    plant: LoopPlant,
    design: Box<dyn ControlDesign>,
    linear: Box<dyn LinearLaw>,
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

    /// P in metres per ampere at z = exp(j w T): hold, amplifier, modes, delays and the probe's rate.
    pub fn sampled_plant(&self, omega_rad_s: f64) -> Complex<f64> {
        self.plant.response(omega_rad_s)
    }

    /// C in amperes per metre at z = exp(j w T).
    pub fn sampled_controller(&self, omega_rad_s: f64) -> Complex<f64> {
        self.linear.response(self.z(omega_rad_s))
    }

    /// L = P C of the sampled loop.
    pub fn sampled_loop(&self, omega_rad_s: f64) -> Complex<f64> {
        self.plant.response(omega_rad_s) * self.linear.response(self.z(omega_rad_s))
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

    /// Margins of the sampled loop.
    pub fn margins(&self) -> Margins {
        let grid = grid(
            self.lowest_rad_s(),
            self.nyquist_rad_s() * (1.0 - 1e-9),
            &self.features(),
        );
        margins(&|w| self.sampled_loop(w), &grid, self.is_stable(), false)
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
        let grid = grid(self.lowest_rad_s(), high_rad_s, &self.features());
        let response = |w| self.continuous_response(sections, w);
        let stable = self.is_stable_in_continuous_time(sections);
        Ok(margins(&response, &grid, stable, true))
    }

    /// Frequencies in rad/s that follow every resonance of plant and controller.
    pub fn frequencies(&self, low_rad_s: f64, high_rad_s: f64) -> Vec<f64> {
        grid(low_rad_s, high_rad_s, &self.features())
    }

    /// Reading (in metres, relative to the start) at each tick after a reference of `reference_m(tick)`: the linear loop
    /// from rest, without noise, disturbance and limits.
    pub fn simulate(&self, ticks: usize, reference_m: impl Fn(usize) -> f64) -> Vec<f64> {
        self.signals(ticks, reference_m)
            .map(|(_, position_m)| position_m)
            .collect()
    }

    /// Command in amperes and reading in metres of each tick of [`simulate`](Self::simulate). The reading is taken
    /// before the command.
    pub fn signals(
        &self,
        ticks: usize,
        reference_m: impl Fn(usize) -> f64,
    ) -> impl Iterator<Item = (f64, f64)> {
        let mut law = self.design.law(self.plant.period_s());
        law.reset(0.0);
        let mut state = self.plant.at_rest();
        let mut applied_a = 0.0;
        (0..ticks).map(move |tick| {
            let position_m = self.plant.reading_m(&state);
            let input = LawInput {
                reference_m: reference_m(tick),
                position_m,
                applied_a,
            };
            applied_a = law.update(&input);
            self.plant.step(&mut state, applied_a);
            (applied_a, position_m)
        })
    }

    fn z(&self, omega_rad_s: f64) -> Complex<f64> {
        let (sine, cosine) = libm::sincos(omega_rad_s * self.plant.period_s());
        Complex::new(cosine, sine)
    }

    fn nyquist_rad_s(&self) -> f64 {
        std::f64::consts::PI / self.plant.period_s()
    }

    /// The lowest frequency of the search for crossings.
    fn lowest_rad_s(&self) -> f64 {
        let slowest = self.modes.iter().find(|mode| mode.omega_rad_s > 0.0);
        1e-3 * slowest
            .map_or(1.0, |mode| mode.omega_rad_s)
            .min(self.nyquist_rad_s())
    }

    /// Frequency and damping ratio of each resonance and antiresonance of the loop: the modes of the plant and the lightly
    /// damped pairs of the control law.
    fn features(&self) -> Vec<(f64, f64)> {
        let modes = self.modes.iter();
        let modes = modes.map(|mode| (mode.omega_rad_s, mode.damping_ratio));
        let pairs = match self.design.sections() {
            Some(sections) => section_pairs(sections),
            None => self.law_poles(),
        };
        let lightly_damped = |(w, zeta): &(f64, f64)| w.is_finite() && *zeta < 0.5;
        let pairs = pairs.into_iter().filter(lightly_damped);
        modes.filter(|(w, _)| *w > 0.0).chain(pairs).collect()
    }

    /// Frequency and damping ratio of the poles of the sampled law: z = exp(s T).
    fn law_poles(&self) -> Vec<(f64, f64)> {
        let poles = self.linear.state_space().poles().unwrap_or_default();
        let continuous = poles.iter().map(|z| z.ln() / self.plant.period_s());
        let pairs = continuous.filter(|s| s.im > 0.0);
        pairs.map(|s| (s.norm(), (s.re / s.norm()).abs())).collect()
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

    fn sampled_poles(&self) -> Option<Vec<Complex<f64>>> {
        let (a, b, c) = self.plant.state_space();
        let plant = StateSpace { a, b, c, d: 0.0 };
        self.linear.state_space().then(&plant).closed_poles()
    }

    fn poles_in_continuous_time(&self, sections: &[Section]) -> Option<Vec<Complex<f64>>> {
        let gain = StateSpace::gain(UM_PER_M);
        let law = sections.iter().fold(gain, |cascade, section| {
            cascade.then(&StateSpace::from(section))
        });
        let plant = StateSpace::of_modes(&self.modes, self.force_constant_n_per_a);
        law.then(&plant).closed_poles()
    }

    /// All poles of the sampled closed loop lie inside the unit circle.
    pub fn is_stable(&self) -> bool {
        let poles = self.sampled_poles();
        poles.is_some_and(|poles| poles.iter().all(|pole| pole.norm() < 1.0))
    }

    /// All poles of the continuous closed loop lie left of the imaginary axis.
    fn is_stable_in_continuous_time(&self, sections: &[Section]) -> bool {
        let poles = self.poles_in_continuous_time(sections);
        poles.is_some_and(|poles| poles.iter().all(|pole| pole.re < 0.0))
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
