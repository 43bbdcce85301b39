//! Maximum likelihood: the parameters of least chi^2.
//!
//! Levenberg-Marquardt steps in ln w, ln zeta and tau. After each step r and R, in which the model is linear, are solved for (G.
//! Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; L. Kaufman, BIT 15 (1975) 49): of modes closer than their widths only
//! certain sums are well determined, and steps in all parameters at once progress slowly along that valley. The damping follows
//! the ratio of actual to predicted decrease (H. B. Nielsen, IMM-REP-1999-05, Technical University of Denmark). With known
//! variances, chi^2 has the mean 2 N less the number of parameters, and the inverse of J^T W J is their covariance.

use core::ops::ControlFlow;

use super::normal_equations::NormalEquations;
use super::parameters::{ModalParameters, Parameter};
use super::solution::{Problem, Solution};

/// Largest number of steps.
const MAX_STEPS: usize = 60;
/// A smaller decrease of chi^2 is negligible: a hundredth of the effect of noise on one parameter.
const NEGLIGIBLE_DECREASE: f64 = 0.01;
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
    if start.modes.is_empty() {
        return Solution::new(problem, start);
    }
    let mut iteration = Iteration::new(problem, start, tolerance);
    for _ in 0..MAX_STEPS {
        if iteration.step().is_break() {
            break;
        }
    }
    iteration.best
}

struct Iteration<'a> {
    problem: Problem<'a>,
    free: Vec<Parameter>,
    best: Solution,
    /// Normal equations of a step from the best solution.
    normal: NormalEquations,
    damping: Damping,
    tolerance: f64,
}

impl<'a> Iteration<'a> {
    fn new(problem: Problem<'a>, start: ModalParameters, tolerance: f64) -> Self {
        let free = start.free();
        let best = Solution::with_best_residues(problem, start);
        let normal = best.normal_equations(problem.data);
        Self {
            problem,
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
        let next = Solution::with_best_residues(self.problem, moved);
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
        self.normal = self.best.normal_equations(self.problem.data);
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
