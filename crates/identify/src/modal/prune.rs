//! Removal of modes that the data do not need.

use super::clusters::with_fewer_in_clusters;
use super::parameters::{ModalParameters, Parameter};
use super::refine::refine;
use super::solution::{Problem, Solution};
use bench_plant::zeros::ModalTerm;

/// Start of the one mode that replaces all below the data: frequency as a ratio of the lowest, and damping ratio.
const BELOW_BAND: (f64, f64) = (0.3, 0.4);
/// A residue below this multiple of its standard deviation is uncertain.
const CERTAIN_SIGMAS: f64 = 5.0;

/// The parameters without the modes whose residues are uncertain, the least certain first, as long as the other modes can take
/// their place without a significant increase of chi^2.
pub(super) fn pruned(problem: Problem<'_>, parameters: ModalParameters) -> ModalParameters {
    let below = with_one_mode_below(problem, refine(problem, parameters, 0.0));
    let mut best = with_fewer_in_clusters(problem, below);
    while best.parameters.modes.len() > 1 {
        let least = least_certain(problem, &best);
        let Some((index, _)) = least.filter(|(_, sigmas)| *sigmas < CERTAIN_SIGMAS) else {
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

/// The parameters without the mode of least certain residue.
pub(super) fn without_least_certain(
    problem: Problem<'_>,
    mut parameters: ModalParameters,
) -> ModalParameters {
    let solution = Solution::new(problem, parameters.clone());
    if let Some((index, _)) = least_certain(problem, &solution) {
        parameters.modes.remove(index);
    }
    refine(problem, parameters, 0.0).parameters
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
    let modes = [combined(&below, low_rad_s)].into_iter().chain(above);
    let start = ModalParameters {
        modes: modes.collect(),
        ..solution.parameters.clone()
    };
    let next = refine(problem, start, 0.0);
    let removed = (below.len() - 1) as f64;
    let limit = removed * problem.significant_decrease() * problem.misfit(solution.chi2);
    if (next.chi2 - solution.chi2) / limit <= 1.0 {
        next
    } else {
        solution
    }
}

/// Start value of one mode in place of several below the lowest frequency of the data.
fn combined(below: &[ModalTerm], low_rad_s: f64) -> ModalTerm {
    ModalTerm {
        omega_rad_s: BELOW_BAND.0 * low_rad_s,
        damping_ratio: BELOW_BAND.1,
        residue_per_kg: below.iter().map(|mode| mode.residue_per_kg).sum(),
    }
}

/// The mode whose residue is the smallest multiple of its standard deviation, and that multiple. If the data do not even determine
/// the parameters, the mode of smallest residue, and 0.
fn least_certain(problem: Problem<'_>, solution: &Solution) -> Option<(usize, f64)> {
    let modes = solution.parameters.modes.iter();
    let sizes: Vec<f64> = modes.map(|mode| mode.residue_per_kg.abs()).collect();
    let Some(covariance) = solution.covariance(problem.data) else {
        return index_of_smallest(&sizes).map(|index| (index, 0.0));
    };
    let free = solution.parameters.free();
    // One residue for each mode, in the order of the modes.
    let residues = (0..free.len()).filter(|i| matches!(free[*i], Parameter::Residue(_)));
    let sigmas: Vec<f64> = sizes
        .iter()
        .zip(residues)
        .map(|(size, i)| size / covariance[(i, i)].sqrt())
        .collect();
    index_of_smallest(&sigmas).map(|index| (index, sigmas[index]))
}

fn index_of_smallest(values: &[f64]) -> Option<usize> {
    (0..values.len()).min_by(|a, b| values[*a].total_cmp(&values[*b]))
}
