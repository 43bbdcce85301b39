//! The output of a sum of modes to a held input from rest, in time, with its derivatives to the parameters.

use crate::modal::{ModalParameters, Parameter};
use bench_plant::zeros::ModalTerm;
use bench_plant::{FAR_RAD_S, LoopPlant, Mode, SignalPath};

/// Change of the logarithm of a parameter for a derivative. Its error is about the square, 1e-10, and rounding over it, 1e-11.
const CHANGE: f64 = 1e-5;
/// Change of the delay for its derivative, as a ratio of the period.
const DELAY_CHANGE: f64 = 1e-3;

/// The input of a record, each sample of which is held, and the signal path through which its output is observed.
#[derive(Clone, Copy)]
pub(super) struct Simulation<'a> {
    pub(super) path: &'a SignalPath,
    pub(super) input: &'a [f64],
}

impl Simulation<'_> {
    /// The output.
    pub(super) fn output(&self, parameters: &ModalParameters) -> Vec<f64> {
        let mut sum = self.constant(parameters.delay_s);
        sum.iter_mut()
            .for_each(|y| *y *= parameters.remainder_m_per_n);
        for term in &parameters.modes {
            let unit = self.of_mode(term.omega_rad_s, term.damping_ratio, parameters.delay_s);
            add(&mut sum, &unit, term.residue_per_kg);
        }
        sum
    }

    /// The change of the output by a change of 1 of each free parameter with real residues, of w and zeta by that of their logarithms, in
    /// the order of [`ModalParameters::free`].
    pub(super) fn derivatives(&self, parameters: &ModalParameters) -> Vec<Vec<f64>> {
        let free = parameters.free();
        free.iter()
            .map(|parameter| self.derivative(parameters, *parameter))
            .collect()
    }

    fn derivative(&self, parameters: &ModalParameters, parameter: Parameter) -> Vec<f64> {
        let (modes, delay_s) = (&parameters.modes, parameters.delay_s);
        match parameter {
            Parameter::Frequency(k) => {
                let ModalTerm {
                    omega_rad_s: w,
                    damping_ratio,
                    residue_per_kg,
                } = modes[k];
                let at = |change: f64| self.of_mode(w * change.exp(), damping_ratio, delay_s);
                central_difference(at, residue_per_kg)
            }
            Parameter::Damping(k) => {
                let ModalTerm {
                    omega_rad_s,
                    damping_ratio: zeta,
                    residue_per_kg,
                } = modes[k];
                let at = |change: f64| self.of_mode(omega_rad_s, zeta * change.exp(), delay_s);
                central_difference(at, residue_per_kg)
            }
            Parameter::Residue(k) => {
                self.of_mode(modes[k].omega_rad_s, modes[k].damping_ratio, delay_s)
            }
            Parameter::Remainder => self.constant(delay_s),
            Parameter::Delay => {
                let change_s = DELAY_CHANGE * self.path.period_s;
                let later = ModalParameters {
                    delay_s: delay_s + change_s,
                    ..parameters.clone()
                };
                let mut difference = self.output(&later);
                add(&mut difference, &self.output(parameters), -1.0);
                difference.iter_mut().for_each(|y| *y /= change_s);
                difference
            }
            Parameter::Rate(_) => vec![0.0; self.input.len()],
        }
    }

    /// The output of a mode of residue 1.
    pub(super) fn of_mode(&self, omega_rad_s: f64, damping_ratio: f64, delay_s: f64) -> Vec<f64> {
        let mode = Mode::unit(omega_rad_s, damping_ratio);
        let whole_s = self.path.mean_delay_s() + delay_s;
        if whole_s >= 0.0 {
            return self.delayed(&mode, whole_s);
        }
        // A simulation has no advance: the output at earlier times by its rate.
        let change_s = DELAY_CHANGE * self.path.period_s;
        let mut output = self.delayed(&mode, 0.0);
        let later = self.delayed(&mode, change_s);
        let ratio = whole_s / change_s;
        for (y, later) in output.iter_mut().zip(later) {
            *y += (later - *y) * ratio;
        }
        output
    }

    fn delayed(&self, mode: &Mode, delay_s: f64) -> Vec<f64> {
        let path = SignalPath {
            delays_s: vec![delay_s],
            ..self.path.clone()
        };
        LoopPlant::of(&path, std::slice::from_ref(mode)).readings_m(self.input)
    }

    /// The output of a constant compliance of 1 m/N.
    fn constant(&self, delay_s: f64) -> Vec<f64> {
        let mut output = self.of_mode(FAR_RAD_S, 1.0, delay_s);
        output.iter_mut().for_each(|y| *y *= FAR_RAD_S * FAR_RAD_S);
        output
    }
}

/// The derivative of a multiple of an output.
fn central_difference(at: impl Fn(f64) -> Vec<f64>, factor: f64) -> Vec<f64> {
    let mut difference = at(CHANGE);
    add(&mut difference, &at(-CHANGE), -1.0);
    let factor = factor / (2.0 * CHANGE);
    difference.iter_mut().for_each(|y| *y *= factor);
    difference
}

/// Adds a multiple of a signal to a sum.
fn add(sum: &mut [f64], signal: &[f64], factor: f64) {
    for (sum, y) in sum.iter_mut().zip(signal) {
        *sum += factor * y;
    }
}
