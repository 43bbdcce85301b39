//! The output of a sum of modes to a held input from rest, in time, with its derivatives to the parameters.

use std::rc::Rc;

use crate::modal::{ModalParameters, Parameter};
use bench_plant::zeros::ModalTerm;
use bench_plant::{FAR_RAD_S, LoopPlant, Mode, SignalPath};

/// Change for a derivative, of ln zeta, and of ln w in units of zeta, the relative half-width of the mode.
///
/// A difference to one side is wrong by the change times half the second derivative, relative to the first one. That ratio is about 1 for
/// ln zeta, and for ln w, of a response about 1/(ln w - ln w0 + j zeta), at most 1/zeta: 1e-6 in both cases. Rounding of the poles, 1e-16
/// in each period, changes the decay by 1e-16/(zeta w T), and the derivative by this over the change: 1e-5 and less from
/// zeta w T = 1e-5 on. The derivatives determine the direction of a step and the covariance, for which both are far less than
/// needed.
const CHANGE: f64 = 1e-6;
/// Least half-width for the change of ln w: a record does not show a smaller one.
const LEAST_WIDTH: f64 = 1e-5;
/// Change of the delay for its derivative, as a ratio of the period.
const DELAY_CHANGE: f64 = 1e-3;

/// The input of a record, each sample of which is held, and the signal path through which its output is observed.
#[derive(Clone, Copy)]
pub(super) struct Simulation<'a> {
    pub(super) path: &'a SignalPath,
    pub(super) input: &'a [f64],
}

/// The output of a mode of residue 1.
#[derive(Clone)]
struct UnitOutput {
    omega_rad_s: f64,
    damping_ratio: f64,
    delay_s: f64,
    output: Rc<[f64]>,
}

/// The outputs whose sum, with the residues as factors, is that of a model.
#[derive(Clone, Default)]
pub(super) struct Parts {
    modes: Vec<UnitOutput>,
    /// That of the mode that stands for the constant compliance; none as long as nothing was simulated.
    far: Option<UnitOutput>,
}

impl Parts {
    /// The output of the model with these parts.
    pub(super) fn sum(&self, parameters: &ModalParameters) -> Vec<f64> {
        let mut sum = self.constant();
        sum.iter_mut()
            .for_each(|y| *y *= parameters.remainder_m_per_n);
        for (term, unit) in parameters.modes.iter().zip(&self.modes) {
            add(&mut sum, &unit.output, term.residue_per_kg);
        }
        sum
    }

    /// The output of a constant compliance of 1 m/N.
    fn constant(&self) -> Vec<f64> {
        let far = self.far.iter().flat_map(|far| far.output.iter());
        far.map(|y| y * (FAR_RAD_S * FAR_RAD_S)).collect()
    }

    /// The part of a mode, if it is one of these.
    fn of_mode(&self, omega_rad_s: f64, damping_ratio: f64, delay_s: f64) -> Option<UnitOutput> {
        let is_it = |unit: &&UnitOutput| {
            unit.omega_rad_s == omega_rad_s
                && unit.damping_ratio == damping_ratio
                && unit.delay_s == delay_s
        };
        self.modes.iter().chain(&self.far).find(is_it).cloned()
    }
}

impl Simulation<'_> {
    /// The output.
    pub(super) fn output(&self, parameters: &ModalParameters) -> Vec<f64> {
        self.parts(parameters, &Parts::default()).sum(parameters)
    }

    /// The parts of the output. Those of `before` with the same frequency, damping and delay are not simulated again.
    pub(super) fn parts(&self, parameters: &ModalParameters, before: &Parts) -> Parts {
        let delay_s = parameters.delay_s;
        let unit = |omega_rad_s: f64, damping_ratio: f64| {
            let known = before.of_mode(omega_rad_s, damping_ratio, delay_s);
            known.unwrap_or_else(|| UnitOutput {
                omega_rad_s,
                damping_ratio,
                delay_s,
                output: self.of_mode(omega_rad_s, damping_ratio, delay_s).into(),
            })
        };
        let modes = parameters.modes.iter();
        Parts {
            modes: modes
                .map(|term| unit(term.omega_rad_s, term.damping_ratio))
                .collect(),
            far: Some(unit(FAR_RAD_S, 1.0)),
        }
    }

    /// The change of the output by a change of 1 of each free parameter with real residues, of w and zeta by that of their logarithms, in
    /// the order of [`ModalParameters::free`]. `parts` are those of the parameters.
    pub(super) fn derivatives(&self, parameters: &ModalParameters, parts: &Parts) -> Vec<Vec<f64>> {
        let free = parameters.free();
        free.iter()
            .map(|parameter| self.derivative(parameters, parts, *parameter))
            .collect()
    }

    fn derivative(
        &self,
        parameters: &ModalParameters,
        parts: &Parts,
        parameter: Parameter,
    ) -> Vec<f64> {
        let (modes, delay_s) = (&parameters.modes, parameters.delay_s);
        match parameter {
            Parameter::Frequency(k) => {
                let ModalTerm {
                    omega_rad_s: w,
                    damping_ratio: zeta,
                    residue_per_kg,
                } = modes[k];
                let change = CHANGE * zeta.max(LEAST_WIDTH);
                let changed = self.of_mode(w * change.exp(), zeta, delay_s);
                difference(changed, &parts.modes[k].output, residue_per_kg / change)
            }
            Parameter::Damping(k) => {
                let ModalTerm {
                    omega_rad_s,
                    damping_ratio: zeta,
                    residue_per_kg,
                } = modes[k];
                let changed = self.of_mode(omega_rad_s, zeta * CHANGE.exp(), delay_s);
                difference(changed, &parts.modes[k].output, residue_per_kg / CHANGE)
            }
            Parameter::Residue(k) => parts.modes[k].output.to_vec(),
            Parameter::Remainder => parts.constant(),
            Parameter::Delay => {
                let change_s = DELAY_CHANGE * self.path.period_s;
                let later = ModalParameters {
                    delay_s: delay_s + change_s,
                    ..parameters.clone()
                };
                let changed = self.output(&later);
                difference(changed, &parts.sum(parameters), 1.0 / change_s)
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
        // A step of the search may try any delay.
        let duration_s = self.input.len() as f64 * self.path.period_s;
        if delay_s.is_nan() || delay_s >= duration_s {
            return vec![0.0; self.input.len()];
        }
        let path = SignalPath {
            delays_s: vec![delay_s],
            ..self.path.clone()
        };
        LoopPlant::of(&path, std::slice::from_ref(mode)).readings_m(self.input)
    }
}

/// The difference of an output from another one, times a factor.
fn difference(mut changed: Vec<f64>, from: &[f64], factor: f64) -> Vec<f64> {
    for (y, from) in changed.iter_mut().zip(from) {
        *y = (*y - from) * factor;
    }
    changed
}

/// Adds a multiple of a signal to a sum.
fn add(sum: &mut [f64], signal: &[f64], factor: f64) {
    for (sum, y) in sum.iter_mut().zip(signal) {
        *sum += factor * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_plant::OutputKind;

    fn term(omega_rad_s: f64, residue_per_kg: f64) -> ModalTerm {
        ModalTerm {
            omega_rad_s,
            damping_ratio: 0.02,
            residue_per_kg,
        }
    }

    #[test]
    fn only_modes_that_change_are_simulated_again() {
        let path = SignalPath {
            period_s: 1e-3,
            amplifier_bandwidth_hz: f64::INFINITY,
            force_constant_n_per_a: 1.0,
            delays_s: vec![0.0],
            output: OutputKind::Position,
        };
        let simulation = Simulation {
            path: &path,
            input: &[1.0, -1.0, 0.5, 0.0, 0.0],
        };
        let parameters = |modes: [ModalTerm; 2], delay_s: f64| ModalParameters {
            modes: modes.to_vec(),
            remainder_m_per_n: 1e-6,
            delay_s,
            ..ModalParameters::default()
        };
        let first = parameters([term(100.0, 1.0), term(200.0, 2.0)], 2e-4);
        let before = simulation.parts(&first, &Parts::default());
        // The second mode has another residue and becomes the first one.
        let next = parameters([term(200.0, 3.0), term(101.0, 1.0)], 2e-4);
        let parts = simulation.parts(&next, &before);
        let is_same = |a: &UnitOutput, b: &UnitOutput| Rc::ptr_eq(&a.output, &b.output);
        assert!(is_same(&parts.modes[0], &before.modes[1]));
        assert!(!is_same(&parts.modes[1], &before.modes[0]));
        assert_eq!(parts.sum(&next), simulation.output(&next));
        // All change with the delay.
        let later = parameters([term(100.0, 1.0), term(200.0, 2.0)], 3e-4);
        let parts = simulation.parts(&later, &before);
        assert!(!is_same(&parts.modes[0], &before.modes[0]));
        assert_eq!(parts.sum(&later), simulation.output(&later));
    }
}
