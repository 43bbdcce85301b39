//! The parameters of a sum of modes.

use core::ops::Range;

use nalgebra::DVector;

use bench_plant::zeros::ModalTerm;

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

/// A sum of modes with a delay.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ModalParameters {
    /// The modes; one with w = 0 is a free body.
    pub modes: Vec<ModalTerm>,
    /// R: the compliance in m/N of modes above the band.
    pub remainder_m_per_n: f64,
    /// tau: the delay beyond that of the measurement chain, in seconds.
    pub delay_s: f64,
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
    /// R.
    Remainder,
    /// tau.
    Delay,
}

impl Parameter {
    /// Whether the model is linear in the parameter.
    pub(super) fn is_linear(self) -> bool {
        matches!(self, Parameter::Residue(_) | Parameter::Remainder)
    }
}

impl ModalParameters {
    /// One mode and a delay.
    pub(super) fn one_mode(mode: ModalTerm, delay_s: f64) -> ModalParameters {
        ModalParameters {
            modes: vec![mode],
            remainder_m_per_n: 0.0,
            delay_s,
        }
    }

    /// The parameters with the lowest frequency first.
    pub(super) fn by_rising_frequency(mut self) -> ModalParameters {
        self.modes
            .sort_by(|a, b| a.omega_rad_s.total_cmp(&b.omega_rad_s));
        self
    }

    /// The parameters with one more mode.
    pub(super) fn with_mode(mut self, mode: ModalTerm) -> ModalParameters {
        self.modes.push(mode);
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
        let mut merged = self.clone();
        let index = modes.start;
        merged.modes.splice(modes, [one]);
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
        next.modes.push(high);
        next
    }

    /// The free parameters, in the order of a covariance.
    pub fn free(&self) -> Vec<Parameter> {
        let mut free = Vec::new();
        for (k, mode) in self.modes.iter().enumerate() {
            if mode.omega_rad_s != 0.0 {
                free.extend([Parameter::Frequency(k), Parameter::Damping(k)]);
            }
            free.push(Parameter::Residue(k));
        }
        free.extend([Parameter::Remainder, Parameter::Delay]);
        free
    }

    /// The values of the free parameters, in their order: w (rad/s), zeta and r of each mode, R and tau.
    pub(crate) fn free_values(&self) -> DVector<f64> {
        let free = self.free();
        let values = free.iter().map(|parameter| match *parameter {
            Parameter::Frequency(k) => self.modes[k].omega_rad_s,
            Parameter::Damping(k) => self.modes[k].damping_ratio,
            Parameter::Residue(k) => self.modes[k].residue_per_kg,
            Parameter::Remainder => self.remainder_m_per_n,
            Parameter::Delay => self.delay_s,
        });
        DVector::from_iterator(free.len(), values)
    }

    /// The parameters with other residues, followed by another R.
    pub(super) fn with_linear(mut self, linear: &DVector<f64>) -> ModalParameters {
        self.remainder_m_per_n = linear[self.modes.len()];
        self.modes
            .iter_mut()
            .zip(linear.iter())
            .for_each(|(mode, r)| mode.residue_per_kg = *r);
        self
    }

    /// The parameters after a step in ln w, ln zeta, r, R and tau, limited to what is possible.
    pub(super) fn moved(&self, free: &[Parameter], step: &DVector<f64>) -> ModalParameters {
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
            Parameter::Remainder => self.remainder_m_per_n += step,
            Parameter::Delay => self.delay_s += step,
        }
    }
}

/// exp(step), with a limited step.
fn factor(step: f64, max: f64) -> f64 {
    step.clamp(-max, max).exp()
}
