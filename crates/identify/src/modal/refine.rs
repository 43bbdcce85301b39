//! Maximum likelihood: the parameters of least chi^2.
//!
//! Levenberg-Marquardt steps in ln w, ln zeta and tau. After each step r and R, in which the model is linear, are solved for (G.
//! Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; L. Kaufman, BIT 15 (1975) 49): of modes closer than their widths only
//! certain sums are well determined, and steps in all parameters at once progress slowly along that valley. The damping follows
//! the ratio of actual to predicted decrease (H. B. Nielsen, IMM-REP-1999-05, Technical University of Denmark). With known
//! variances, chi^2 has the mean 2 N less the number of parameters, and the inverse of J^T W J is their covariance.

use core::ops::ControlFlow;

use super::normal_equations::NormalEquations;
use super::parameters::{ModalParameters, Moving, Parameter};
use super::solution::{Problem, Solution};

/// Largest number of steps.
const MAX_STEPS: usize = 60;
/// A smaller decrease of chi^2 is negligible: a hundredth of the effect of noise on one parameter.
const NEGLIGIBLE_DECREASE: f64 = 0.01;
/// Number of modes that move where starts are compared that differ in one or two modes.
const MOVING_MODES: usize = 5;
/// Damping of the first step, relative to a diagonal of 1.
const FIRST_DAMPING: f64 = 1e-3;
/// Smallest damping.
const MIN_DAMPING: f64 = 1e-9;
/// The search ends without success above this damping.
const MAX_DAMPING: f64 = 1e8;
/// Largest reduction of the damping in one step.
const DAMPING_REDUCTION: f64 = 0.1;

/// The solution of least chi^2 near `start`. The iteration ends when a step decreases chi^2 by less than `tolerance` of it.
pub(super) fn refine(problem: Problem<'_>, start: ModalParameters, tolerance: f64) -> Solution {
    refine_moving(problem, start, Moving::All, tolerance, f64::NEG_INFINITY)
}

/// As [`refine`], until chi^2 is below `enough`: where only that is to be known.
pub(super) fn refine_below(
    problem: Problem<'_>,
    start: ModalParameters,
    tolerance: f64,
    enough: f64,
) -> Solution {
    refine_moving(problem, start, Moving::All, tolerance, enough)
}

/// As [`refine`], with w and zeta of the [`MOVING_MODES`] nearest to a frequency only, all residues and R: at a fraction of the cost, how good
/// a start is that differs from a minimum there.
pub(super) fn refine_near(
    problem: Problem<'_>,
    start: ModalParameters,
    omega_rad_s: f64,
    tolerance: f64,
) -> Solution {
    let moving = if moves_all(&start) {
        Moving::All
    } else {
        Moving::Modes(start.nearest_modes(omega_rad_s, MOVING_MODES))
    };
    refine_moving(problem, start, moving, tolerance, f64::NEG_INFINITY)
}

/// Whether [`refine_near`] moves all parameters: those of few modes, or of complex residues, which leave the delay open.
pub(super) fn moves_all(start: &ModalParameters) -> bool {
    start.modes.len() <= MOVING_MODES || !start.has_real_residues()
}

fn refine_moving(
    problem: Problem<'_>,
    start: ModalParameters,
    moving: Moving,
    tolerance: f64,
    enough: f64,
) -> Solution {
    if start.modes.is_empty() {
        return Solution::new(problem, start);
    }
    let mut iteration = Iteration::new(problem, start, moving, tolerance);
    for _ in 0..MAX_STEPS {
        if iteration.best.chi2 < enough || iteration.step().is_break() {
            break;
        }
    }
    iteration.best
}

struct Iteration<'a> {
    problem: Problem<'a>,
    moving: Moving,
    free: Vec<Parameter>,
    best: Solution,
    /// Normal equations of a step from the best solution.
    normal: NormalEquations,
    damping: Damping,
    tolerance: f64,
}

impl<'a> Iteration<'a> {
    fn new(problem: Problem<'a>, start: ModalParameters, moving: Moving, tolerance: f64) -> Self {
        let mut free = start.free();
        free.retain(|parameter| moving.includes(*parameter));
        let best = Solution::with_best_residues(problem, start);
        let normal = best.normal_equations(problem, &moving);
        Self {
            problem,
            moving,
            free,
            best,
            normal,
            damping: Damping::first(),
            tolerance,
        }
    }

    /// The damping of a parameter; 0 where the model is linear in it.
    fn damping_of(&self, parameter: Parameter) -> f64 {
        if parameter.is_linear() {
            0.0
        } else {
            self.damping.value
        }
    }

    fn step(&mut self) -> ControlFlow<()> {
        let Some(step) = self.normal.solve(|i| self.damping_of(self.free[i])) else {
            return ControlFlow::Break(());
        };
        let moved = self.best.parameters.moved(&self.free, &step);
        let next = match &self.moving {
            Moving::All => Solution::with_best_residues(self.problem, moved),
            Moving::Modes(modes) => self.best.with_moved_modes(self.problem, moved, modes),
        };
        let decrease = self.best.chi2 - next.chi2;
        let predicted = self.normal.predicted_decrease(&step);
        if decrease.is_finite() && decrease >= 0.0 {
            self.accept(next, decrease, predicted)
        } else if self.damping.value > MAX_DAMPING || predicted < NEGLIGIBLE_DECREASE {
            ControlFlow::Break(())
        } else {
            self.damping.increase();
            ControlFlow::Continue(())
        }
    }

    fn accept(&mut self, next: Solution, decrease: f64, predicted: f64) -> ControlFlow<()> {
        let negligible = decrease < NEGLIGIBLE_DECREASE + self.tolerance * next.chi2;
        self.best = next;
        if negligible && self.damping.value < 1.0 {
            return ControlFlow::Break(());
        }
        self.damping.decrease(decrease / predicted);
        self.normal = self.best.normal_equations(self.problem, &self.moving);
        ControlFlow::Continue(())
    }
}

/// The Levenberg-Marquardt damping, relative to a diagonal of 1.
struct Damping {
    value: f64,
    increase_factor: f64,
}

impl Damping {
    fn first() -> Self {
        Self {
            value: FIRST_DAMPING,
            increase_factor: 2.0,
        }
    }

    /// After a successful step with this ratio of actual to predicted decrease.
    fn decrease(&mut self, gain_ratio: f64) {
        let factor = (1.0 - (2.0 * gain_ratio - 1.0).powi(3)).clamp(DAMPING_REDUCTION, 2.0);
        *self = Self {
            value: (self.value * factor).max(MIN_DAMPING),
            increase_factor: 2.0,
        };
    }

    /// After a rejected step: by factors of 2, 4, 8, ...
    fn increase(&mut self) {
        self.value *= self.increase_factor;
        self.increase_factor *= 2.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FrfDatum;
    use crate::modal::MeasurementChain;
    use bench_plant::zeros::ModalTerm;
    use nalgebra::Complex;

    /// Seven modes from 10 to 70 Hz, with equal residues.
    fn modes() -> Vec<ModalTerm> {
        let mode = |k: u32| ModalTerm {
            omega_rad_s: std::f64::consts::TAU * 10.0 * f64::from(k),
            damping_ratio: 0.01,
            residue_per_kg: 1.0,
        };
        (1..=7).map(mode).collect()
    }

    fn data() -> Vec<FrfDatum> {
        let datum = |k: u32| {
            let frequency_hz = 5.0 + 0.05 * f64::from(k);
            let s = Complex::new(0.0, std::f64::consts::TAU * frequency_hz);
            FrfDatum {
                frequency_hz,
                spread_hz: 0.0,
                response: modes().iter().map(|mode| mode.resonance(s)).sum(),
                variance: 1e-16,
            }
        };
        (0..1500).map(datum).collect()
    }

    #[test]
    fn moves_only_the_modes_near_a_frequency() {
        let (data, chain) = (&data(), &MeasurementChain::Direct);
        let nodes = &chain.nodes(data, 0.0);
        let problem = Problem { chain, data, nodes };
        let mut start = ModalParameters {
            modes: modes(),
            ..ModalParameters::default()
        };
        // The nearest to 30 Hz are those from 10 to 50 Hz.
        for k in [2, 6] {
            start.modes[k].omega_rad_s *= 1.001;
        }
        let near = refine_near(problem, start.clone(), start.modes[2].omega_rad_s, 0.0);
        let error = |solution: &Solution, k: usize| {
            let truth = modes()[k].omega_rad_s;
            (solution.parameters.modes[k].omega_rad_s / truth - 1.0).abs()
        };
        // The error of 0.1 % at 70 Hz is 10 % of its half-width, and its flank at 30 Hz is 1e-3 of the resonance there.
        assert!(error(&near, 2) < 1e-4, "{}", error(&near, 2));
        assert_eq!(
            near.parameters.modes[5..],
            [
                ModalTerm {
                    residue_per_kg: near.parameters.modes[5].residue_per_kg,
                    ..start.modes[5]
                },
                ModalTerm {
                    residue_per_kg: near.parameters.modes[6].residue_per_kg,
                    ..start.modes[6]
                },
            ]
        );
        let all = refine(problem, near.parameters, 0.0);
        assert!(error(&all, 6) < 1e-6, "{}", error(&all, 6));
    }
}
