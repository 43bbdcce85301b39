//! Removal of modes that the data do not need.

use super::clusters::with_fewer_in_clusters;
use super::parameters::{ModalParameters, Parameter};
use super::refine::refine;
use super::solution::{Problem, Solution};
use bench_plant::zeros::ModalTerm;
use nalgebra::DMatrix;

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
        let next = refine(problem, best.parameters.without_mode(index), 0.0);
        let significant = problem.significant_decrease(&best.parameters.residues);
        if next.chi2 - best.chi2 > significant * problem.misfit(best.chi2) {
            break;
        }
        best = next;
    }
    best.parameters
}

/// The parameters without the mode of least certain residue.
pub(super) fn without_least_certain(
    problem: Problem<'_>,
    parameters: ModalParameters,
) -> ModalParameters {
    let solution = Solution::new(problem, parameters.clone());
    let fewer = match least_certain(problem, &solution) {
        Some((index, _)) => parameters.without_mode(index),
        None => parameters,
    };
    refine(problem, fewer, 0.0).parameters
}

/// The solution with one mode in place of all below the data, if it is as good: with friction, a free body is fitted by several
/// modes that cannot be separated.
fn with_one_mode_below(problem: Problem<'_>, solution: Solution) -> Solution {
    let low_rad_s = problem.data[0].omega_rad_s();
    let ModalParameters {
        modes, residues, ..
    } = &solution.parameters;
    let (below, above): (Vec<usize>, Vec<usize>) =
        (0..modes.len()).partition(|k| modes[*k].omega_rad_s < low_rad_s);
    if below.len() < 2 {
        return solution;
    }
    let one = combined(below.iter().map(|k| &modes[*k]), low_rad_s);
    let start = solution.parameters.selected(&above).with_mode_at(0, one);
    let next = refine(problem, start, 0.0);
    let removed = (below.len() - 1) as f64;
    let limit = removed * problem.significant_decrease(residues) * problem.misfit(solution.chi2);
    if (next.chi2 - solution.chi2) / limit <= 1.0 {
        next
    } else {
        solution
    }
}

/// Start value of one mode in place of several below the lowest frequency of the data.
fn combined<'a>(below: impl Iterator<Item = &'a ModalTerm>, low_rad_s: f64) -> ModalTerm {
    ModalTerm {
        omega_rad_s: BELOW_BAND.0 * low_rad_s,
        damping_ratio: BELOW_BAND.1,
        residue_per_kg: below.map(|mode| mode.residue_per_kg).sum(),
    }
}

/// The mode whose residue is the smallest multiple of its standard deviation, and that multiple. If the data do not even determine
/// the parameters, the mode of smallest residue, and 0.
fn least_certain(problem: Problem<'_>, solution: &Solution) -> Option<(usize, f64)> {
    let parameters = &solution.parameters;
    let Some(covariance) = solution.covariance(problem) else {
        let residues = parameters.complex_residues();
        let sizes: Vec<f64> = residues.iter().map(|residue| residue.norm()).collect();
        return index_of_smallest(&sizes).map(|index| (index, 0.0));
    };
    let sigmas = sigmas_of_residues(parameters, &covariance);
    index_of_smallest(&sigmas).map(|index| (index, sigmas[index]))
}

/// Each residue as a multiple of its standard deviation; of a complex one the larger multiple of r and q.
pub(crate) fn sigmas_of_residues(
    parameters: &ModalParameters,
    covariance: &DMatrix<f64>,
) -> Vec<f64> {
    let (free, values) = (parameters.free(), parameters.free_values());
    let mut sigmas = vec![0.0; parameters.modes.len()];
    for (i, parameter) in free.iter().enumerate() {
        let multiple = values[i].abs() / covariance[(i, i)].sqrt();
        match *parameter {
            Parameter::Residue(k) => sigmas[k] = multiple,
            // q follows r.
            Parameter::Rate(k) => sigmas[k] = multiple.max(sigmas[k]),
            _ => {}
        }
    }
    sigmas
}

fn index_of_smallest(values: &[f64]) -> Option<usize> {
    (0..values.len()).min_by(|a, b| values[*a].total_cmp(&values[*b]))
}
