//! Removal of modes that the data do not need.

use super::parameters::{ModalParameters, Parameter};
use super::refine::refine;
use super::solution::{Problem, Solution};
use crate::model::zeros::ModalTerm;

/// Start of the one mode that replaces all below the data: frequency as a ratio of the lowest, and damping ratio.
const BELOW_BAND: (f64, f64) = (0.3, 0.4);
/// A residue below this multiple of its standard deviation is uncertain.
const CERTAIN_SIGMAS: f64 = 5.0;

/// The parameters without the modes whose residues are uncertain, the least certain first, as long as the other modes can take
/// their place without a significant increase of chi^2.
pub(super) fn pruned(problem: Problem<'_>, parameters: ModalParameters) -> ModalParameters {
    let mut best = with_one_mode_below(problem, refine(problem, parameters, 0.0));
    while best.parameters.modes.len() > 1 {
        let Some(index) = least_certain(problem, &best) else {
            break;
        };
        let mut fewer = best.parameters.clone();
        fewer.modes.remove(index);
        let next = refine(problem, fewer, 0.0);
        if next.chi2 - best.chi2 > problem.significant_decrease() * problem.misfit(best.chi2) {
            break;
        }
        best = next;
    }
    best.parameters
}

/// The solution with one mode in place of all below the data, if it is as good: with friction, a free body is fitted by several
/// modes that cannot be separated.
fn with_one_mode_below(problem: Problem<'_>, solution: Solution) -> Solution {
    let low_rad_s = problem.data[0].omega_rad_s();
    let modes = solution.parameters.modes.iter();
    let (below, above): (Vec<ModalTerm>, Vec<ModalTerm>) =
        modes.partition(|mode| mode.omega_rad_s < low_rad_s);
    if below.len() < 2 {
        return solution;
    }
    let one = ModalTerm {
        omega_rad_s: BELOW_BAND.0 * low_rad_s,
        damping_ratio: BELOW_BAND.1,
        residue_per_kg: below.iter().map(|mode| mode.residue_per_kg).sum(),
    };
    let modes = [one].into_iter().chain(above).collect();
    let next = refine(
        problem,
        ModalParameters {
            modes,
            ..solution.parameters.clone()
        },
        0.0,
    );
    let removed = (below.len() - 1) as f64;
    let limit = removed * problem.significant_decrease() * problem.misfit(solution.chi2);
    if (next.chi2 - solution.chi2) / limit <= 1.0 {
        next
    } else {
        solution
    }
}

/// The mode whose residue is the smallest multiple of its standard deviation, if that is uncertain. If the data do not even
/// determine the parameters, the mode of smallest residue.
fn least_certain(problem: Problem<'_>, solution: &Solution) -> Option<usize> {
    let modes = &solution.parameters.modes;
    let size = |k: &usize| modes[*k].residue_per_kg.abs();
    let indices = 0..modes.len();
    let Some(covariance) = solution.covariance(problem.data) else {
        return indices.min_by(|a, b| size(a).total_cmp(&size(b)));
    };
    let free = solution.parameters.free();
    let sigmas = |k: &usize| {
        let index = free
            .iter()
            .position(|parameter| *parameter == Parameter::Residue(*k));
        index.map_or(f64::INFINITY, |i| size(k) / covariance[(i, i)].sqrt())
    };
    let least = indices.min_by(|a, b| sigmas(a).total_cmp(&sigmas(b)))?;
    (sigmas(&least) < CERTAIN_SIGMAS).then_some(least)
}
