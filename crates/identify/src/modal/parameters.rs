//! The parameters of a sum of modes.

use core::ops::Range;

use nalgebra::{Complex, DVector};

use bench_plant::PlantError;
use bench_plant::zeros::{ModalSum, ModalTerm};

/// Largest change of ln w in a step.
const MAX_FREQUENCY_STEP: f64 = 0.02;
/// Largest change of ln zeta in a step.
const MAX_DAMPING_STEP: f64 = 0.7;
/// Bounds of a damping ratio.
const DAMPING_RATIO: (f64, f64) = (1e-6, 2.0);

/// A mode is split for a residual at most this many half-widths away: beyond, a mode there is another one.
const SPLIT_REACH: f64 = 3.0;
/// One of two modes in place of one.
struct Part {
    /// Its distance from that one in half-widths.
    side: f64,
    /// Its damping as a multiple.
    damping: f64,
}

/// Two peaks side by side; a narrow mode within a broad one, below and above its middle. Closer than their widths, the best two modes
/// depend on the start.
const SPLITS: [[Part; 2]; 3] = [
    [
        Part {
            side: -1.0,
            damping: 0.5,
        },
        Part {
            side: 1.0,
            damping: 0.5,
        },
    ],
    [
        Part {
            side: -0.3,
            damping: 0.3,
        },
        Part {
            side: 0.3,
            damping: 1.0,
        },
    ],
    [
        Part {
            side: -0.3,
            damping: 1.0,
        },
        Part {
            side: 0.3,
            damping: 0.3,
        },
    ],
];
/// Only a mode with a peak is split.
const MAX_SPLIT_DAMPING: f64 = 0.2;

/// Whether the residues of a sum of modes are real or complex.
///
/// ```text
/// (r + q s)/(s^2 + 2 zeta w s + w^2)          r in 1/kg, the rate q in s/kg; at s = j w the numerator is r + j q w
/// ```
///
/// Of a stage with proportional damping they are real, q = 0. With other damping, gyroscopic forces, or a filter between input and output
/// they are complex.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Residues {
    /// q = 0.
    #[default]
    Real,
    /// q of each mode in s/kg, in the order of the modes.
    Complex(Vec<f64>),
}

impl Residues {
    /// Complex residues of no modes.
    pub(crate) fn complex() -> Residues {
        Residues::Complex(Vec::new())
    }

    /// `real` or `complex`.
    pub fn name(&self) -> &'static str {
        match self {
            Residues::Real => "real",
            Residues::Complex(_) => "complex",
        }
    }

    /// Number of parameters of a mode: w, zeta, r, and q of a complex residue.
    pub(super) fn parameters_per_mode(&self) -> f64 {
        match self {
            Residues::Real => 3.0,
            Residues::Complex(_) => 4.0,
        }
    }

    /// q of a mode.
    fn rate(&self, k: usize) -> f64 {
        match self {
            Residues::Real => 0.0,
            Residues::Complex(rates) => rates[k],
        }
    }

    /// Those of the modes with these indices.
    fn selected(&self, indices: &[usize]) -> Residues {
        match self {
            Residues::Real => Residues::Real,
            Residues::Complex(rates) => {
                Residues::Complex(indices.iter().map(|k| rates[*k]).collect())
            }
        }
    }

    /// Adds q to that of a mode, if residues are complex.
    fn add_rate(&mut self, k: usize, difference: f64) {
        if let Residues::Complex(rates) = self {
            rates[k] += difference;
        }
    }
}

/// A sum of modes with a delay.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModalParameters {
    /// The modes; one with w = 0 is a free body. Their residues are the real parts r.
    pub modes: Vec<ModalTerm>,
    /// Whether the residues have imaginary parts as well.
    pub residues: Residues,
    /// R: the compliance in m/N of modes above the band.
    pub remainder_m_per_n: f64,
    /// tau: the delay beyond that of the measurement chain, in seconds.
    pub delay_s: f64,
    /// Whether tau is no free parameter. Complex residues do not determine it: (r + q s) exp(-s tau) and (r + (q + r d) s) exp(-s (tau + d))
    /// differ by the second power of s d only, which R and the rates of the other modes can represent.
    pub has_fixed_delay: bool,
}

/// One free parameter; modes are given by their index.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// w of a mode.
    Frequency(usize),
    /// zeta of a mode.
    Damping(usize),
    /// r of a mode.
    Residue(usize),
    /// q of a mode with a complex residue.
    Rate(usize),
    /// R.
    Remainder,
    /// tau.
    Delay,
}

/// The parameters that a refinement changes.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Moving {
    /// All free parameters.
    All,
    /// Residues and R, and w and zeta of the modes with these indices.
    Modes(Vec<usize>),
}

impl Moving {
    pub(super) fn includes(&self, parameter: Parameter) -> bool {
        match (self, parameter) {
            (Moving::All, _) => true,
            (Moving::Modes(modes), Parameter::Frequency(k) | Parameter::Damping(k)) => {
                modes.contains(&k)
            }
            (Moving::Modes(_), parameter) => parameter.is_linear(),
        }
    }
}

impl Parameter {
    /// Whether the model is linear in the parameter.
    pub(super) fn is_linear(self) -> bool {
        matches!(
            self,
            Parameter::Residue(_) | Parameter::Rate(_) | Parameter::Remainder
        )
    }
}

impl ModalParameters {
    /// No modes, to which modes with such residues are added.
    pub(super) fn without_modes(residues: &Residues) -> ModalParameters {
        ModalParameters {
            residues: residues.selected(&[]),
            ..ModalParameters::default()
        }
    }

    /// Whether all residues are real.
    pub fn has_real_residues(&self) -> bool {
        self.residues == Residues::Real
    }

    /// q of a mode in s/kg.
    pub fn rate_s_per_kg(&self, k: usize) -> f64 {
        self.residues.rate(k)
    }

    /// The numerator r + q s of a mode.
    pub(crate) fn numerator(&self, k: usize, s: Complex<f64>) -> Complex<f64> {
        let residue = self.modes[k].residue_per_kg;
        match &self.residues {
            Residues::Real => Complex::new(residue, 0.0),
            Residues::Complex(rates) => s * rates[k] + residue,
        }
    }

    /// r + j q w of each mode: its numerator at its frequency, the complex residue.
    pub(super) fn complex_residues(&self) -> Vec<Complex<f64>> {
        let modes = self.modes.iter().enumerate();
        modes
            .map(|(k, mode)| self.numerator(k, Complex::new(0.0, mode.omega_rad_s)))
            .collect()
    }

    /// The transfer function without the delay.
    ///
    /// # Errors
    /// When all residues and R are zero.
    pub fn sum(&self) -> Result<ModalSum, PlantError> {
        match &self.residues {
            Residues::Real => ModalSum::new(self.modes.clone(), self.remainder_m_per_n),
            Residues::Complex(rates) => {
                let terms = self.modes.iter().copied().zip(rates.iter().copied());
                ModalSum::with_rates(terms.collect(), self.remainder_m_per_n)
            }
        }
    }

    /// The same transfer function, up to the second power of s d, with complex residues and a delay that is longer by d.
    pub(super) fn with_longer_delay(mut self, d_s: f64) -> ModalParameters {
        self.delay_s += d_s;
        for (k, mode) in self.modes.iter().enumerate() {
            self.residues.add_rate(k, mode.residue_per_kg * d_s);
        }
        self
    }

    /// The parameters with only the modes of these indices, in their order.
    pub(crate) fn selected(&self, indices: &[usize]) -> ModalParameters {
        ModalParameters {
            modes: indices.iter().map(|k| self.modes[*k]).collect(),
            residues: self.residues.selected(indices),
            ..*self
        }
    }

    /// The parameters without one mode.
    pub(crate) fn without_mode(&self, index: usize) -> ModalParameters {
        let others: Vec<usize> = (0..self.modes.len()).filter(|k| *k != index).collect();
        self.selected(&others)
    }

    /// The parameters with the lowest frequency first.
    pub(crate) fn by_rising_frequency(self) -> ModalParameters {
        let omega = |k: &usize| self.modes[*k].omega_rad_s;
        let mut order: Vec<usize> = (0..self.modes.len()).collect();
        order.sort_by(|a, b| omega(a).total_cmp(&omega(b)));
        self.selected(&order)
    }

    /// The parameters with one more mode, of a real residue, as the last one.
    pub(super) fn with_mode(self, mode: ModalTerm) -> ModalParameters {
        let last = self.modes.len();
        self.with_mode_at(last, mode)
    }

    /// The parameters with one more mode, of a real residue, at an index.
    pub(super) fn with_mode_at(mut self, index: usize, mode: ModalTerm) -> ModalParameters {
        self.modes.insert(index, mode);
        if let Residues::Complex(rates) = &mut self.residues {
            rates.insert(index, 0.0);
        }
        self
    }

    /// The parameters with the nearest mode within [`SPLIT_REACH`] half-widths of a frequency replaced by two, in each way of [`SPLITS`];
    /// none if there is no such mode.
    pub(super) fn with_split_mode(&self, omega_rad_s: f64) -> Vec<ModalParameters> {
        let Some(index) = self.mode_at(omega_rad_s) else {
            return Vec::new();
        };
        let splits = SPLITS.iter().map(|split| self.split(index, split));
        splits.collect()
    }

    /// The parameters with neighbouring modes replaced by two, in each way of [`SPLITS`] of one mode in their place.
    pub(super) fn with_pair_in_place(&self, modes: Range<usize>) -> Vec<ModalParameters> {
        let replaced = &self.modes[modes.clone()];
        let sum = |of: fn(&ModalTerm) -> f64| replaced.iter().map(of).sum::<f64>();
        let size = sum(|mode| mode.residue_per_kg.abs());
        let one = ModalTerm {
            omega_rad_s: sum(|mode| mode.residue_per_kg.abs() * mode.omega_rad_s) / size,
            damping_ratio: sum(|mode| mode.residue_per_kg.abs() * mode.damping_ratio) / size,
            residue_per_kg: sum(|mode| mode.residue_per_kg),
        };
        let others: Vec<usize> = (0..self.modes.len())
            .filter(|k| !modes.contains(k))
            .collect();
        let index = modes.start;
        let merged = self.selected(&others).with_mode_at(index, one);
        let splits = SPLITS.iter().map(|split| merged.split(index, split));
        splits.collect()
    }

    /// The mode with a peak that is nearest to a frequency, within [`SPLIT_REACH`] half-widths.
    fn mode_at(&self, omega_rad_s: f64) -> Option<usize> {
        let distance = |mode: &ModalTerm| {
            let half_width_rad_s = mode.damping_ratio * mode.omega_rad_s;
            (mode.omega_rad_s - omega_rad_s).abs() / half_width_rad_s
        };
        let near = |mode: &&ModalTerm| {
            mode.damping_ratio < MAX_SPLIT_DAMPING && distance(mode) < SPLIT_REACH
        };
        let modes = self.modes.iter().enumerate();
        let close = modes.filter(|(_, mode)| near(mode));
        let nearest = close.min_by(|(_, a), (_, b)| distance(a).total_cmp(&distance(b)))?;
        Some(nearest.0)
    }

    fn split(&self, index: usize, split: &[Part; 2]) -> ModalParameters {
        let mut next = self.clone();
        let one = next.modes[index];
        let [low, high] = split.each_ref().map(|part| ModalTerm {
            omega_rad_s: one.omega_rad_s * (1.0 + part.side * one.damping_ratio),
            damping_ratio: part.damping * one.damping_ratio,
            residue_per_kg: 0.5 * one.residue_per_kg,
        });
        next.modes[index] = low;
        next.with_mode(high)
    }

    /// The indices of the modes nearest to a frequency, at most `count`.
    pub(super) fn nearest_modes(&self, omega_rad_s: f64, count: usize) -> Vec<usize> {
        let distance = |k: &usize| (self.modes[*k].omega_rad_s - omega_rad_s).abs();
        let mut indices: Vec<usize> = (0..self.modes.len()).collect();
        indices.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        indices.truncate(count);
        indices
    }

    /// The free parameters, in the order of a covariance.
    pub fn free(&self) -> Vec<Parameter> {
        let mut free = Vec::new();
        for (k, mode) in self.modes.iter().enumerate() {
            if mode.omega_rad_s != 0.0 {
                free.extend([Parameter::Frequency(k), Parameter::Damping(k)]);
            }
            free.push(Parameter::Residue(k));
            if !self.has_real_residues() {
                free.push(Parameter::Rate(k));
            }
        }
        free.push(Parameter::Remainder);
        if !self.has_fixed_delay {
            free.push(Parameter::Delay);
        }
        free
    }

    /// The values of the free parameters, in their order: w (rad/s), zeta, r and, if complex, q of each mode, R, and tau unless it is fixed.
    pub(crate) fn free_values(&self) -> DVector<f64> {
        let free = self.free();
        let values = free.iter().map(|parameter| match *parameter {
            Parameter::Frequency(k) => self.modes[k].omega_rad_s,
            Parameter::Damping(k) => self.modes[k].damping_ratio,
            Parameter::Residue(k) => self.modes[k].residue_per_kg,
            Parameter::Rate(k) => self.residues.rate(k),
            Parameter::Remainder => self.remainder_m_per_n,
            Parameter::Delay => self.delay_s,
        });
        DVector::from_iterator(free.len(), values)
    }

    /// The parameters with other residues: r of all modes, q of all modes with complex ones, and R.
    pub(super) fn with_linear(mut self, linear: &DVector<f64>) -> ModalParameters {
        let mut values = linear.iter().copied();
        for (mode, r) in self.modes.iter_mut().zip(&mut values) {
            mode.residue_per_kg = r;
        }
        if let Residues::Complex(rates) = &mut self.residues {
            for (rate, q) in rates.iter_mut().zip(&mut values) {
                *rate = q;
            }
        }
        self.remainder_m_per_n = values.next().unwrap_or(self.remainder_m_per_n);
        self
    }

    /// The parameters after a step in ln w, ln zeta, r, q, R and tau, limited to what is possible.
    pub(crate) fn moved(&self, free: &[Parameter], step: &DVector<f64>) -> ModalParameters {
        let mut next = self.clone();
        for (parameter, step) in free.iter().zip(step.iter()) {
            next.change(*parameter, *step);
        }
        next
    }

    /// The parameters with a difference added to each free one, in its own unit; dampings keep their bounds.
    pub fn shifted(&self, difference: &[f64]) -> ModalParameters {
        let mut next = self.clone();
        for (parameter, difference) in self.free().into_iter().zip(difference) {
            next.add(parameter, *difference);
        }
        next
    }

    fn add(&mut self, parameter: Parameter, difference: f64) {
        match parameter {
            Parameter::Frequency(k) => self.modes[k].omega_rad_s += difference,
            Parameter::Damping(k) => {
                let ratio = self.modes[k].damping_ratio + difference;
                self.modes[k].damping_ratio = ratio.clamp(DAMPING_RATIO.0, DAMPING_RATIO.1);
            }
            Parameter::Residue(k) => self.modes[k].residue_per_kg += difference,
            Parameter::Rate(k) => self.residues.add_rate(k, difference),
            Parameter::Remainder => self.remainder_m_per_n += difference,
            Parameter::Delay => self.delay_s += difference,
        }
    }

    fn change(&mut self, parameter: Parameter, step: f64) {
        match parameter {
            Parameter::Frequency(k) => {
                self.modes[k].omega_rad_s *= factor(step, MAX_FREQUENCY_STEP)
            }
            Parameter::Damping(k) => {
                let ratio = self.modes[k].damping_ratio * factor(step, MAX_DAMPING_STEP);
                self.modes[k].damping_ratio = ratio.clamp(DAMPING_RATIO.0, DAMPING_RATIO.1);
            }
            Parameter::Residue(k) => self.modes[k].residue_per_kg += step,
            Parameter::Rate(k) => self.residues.add_rate(k, step),
            Parameter::Remainder => self.remainder_m_per_n += step,
            Parameter::Delay => self.delay_s += step,
        }
    }
}

/// exp(step), with a limited step.
fn factor(step: f64, max: f64) -> f64 {
    step.clamp(-max, max).exp()
}
