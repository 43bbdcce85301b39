//! Fewer modes in place of a cluster.
//!
//! Modes are added one at a time. Two modes closer than their widths are therefore sometimes fitted by three or more, whose residues
//! are large and nearly cancel. None of them can be removed alone. Here a cluster is replaced as a whole.

use core::ops::Range;

use nalgebra::Complex;

use super::parameters::ModalParameters;
use super::refine::{refine, refine_near};
use super::solution::{Problem, Solution};
use crate::chi2_limits::MAX_CHI2_PER_FREEDOM;
use bench_plant::zeros::ModalTerm;

/// Neighbouring modes belong to one cluster if their distance is below this multiple of the sum of their half-widths zeta w.
const REACH: f64 = 4.0;
/// The residues of a cluster cancel if the sum of their magnitudes exceeds the magnitude of their sum by this factor.
const CANCELLATION: f64 = 3.0;
/// Modes of a pair.
const PAIR: usize = 2;
/// Largest number of starts for each number of modes.
const MAX_STARTS: usize = 12;
/// Tolerance of the fit of each start, see [`refine`]: with a thousand data, a twentieth of the decrease that is significant.
const TOLERANCE: f64 = 1e-3;
/// The best of them is fitted further only if its misfit is below this multiple of that with the cluster. A replacement that is
/// accepted increases it by a few per cent with a thousand data.
const PROMISING: f64 = 2.0;

/// The solution with fewer modes in each cluster whose residues cancel, if that is as good.
pub(super) fn with_fewer_in_clusters(problem: Problem<'_>, solution: Solution) -> Solution {
    let parameters = solution.parameters.by_rising_frequency();
    // From the last cluster on: the positions of the others remain.
    let clusters = clusters(&parameters).into_iter().rev();
    let solution = Solution::new(problem, parameters);
    clusters.fold(solution, |best, cluster| {
        with_fewer(problem, &best, cluster).unwrap_or(best)
    })
}

/// The clusters of modes, of rising frequency, whose residues cancel: their indices.
pub(super) fn cancelling(parameters: &ModalParameters) -> Vec<Range<usize>> {
    let clusters = clusters(parameters);
    clusters.iter().map(Cluster::modes).collect()
}

/// Neighbours in a list of modes of rising frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cluster {
    first: usize,
    count: usize,
}

impl Cluster {
    /// The indices of its modes.
    fn modes(&self) -> Range<usize> {
        self.first..self.first + self.count
    }

    /// Mean frequency of its modes, which are among these parameters, in rad/s.
    fn mean_omega_rad_s(&self, parameters: &ModalParameters) -> f64 {
        let modes = &parameters.modes[self.modes()];
        let sum_rad_s: f64 = modes.iter().map(|mode| mode.omega_rad_s).sum();
        sum_rad_s / modes.len() as f64
    }
}

/// The clusters whose residues cancel.
fn clusters(parameters: &ModalParameters) -> Vec<Cluster> {
    let (modes, residues) = (&parameters.modes, parameters.complex_residues());
    let mut clusters = Vec::new();
    let mut first = 0;
    for next in 1..=modes.len() {
        if next < modes.len() && are_close(&modes[next - 1], &modes[next]) {
            continue;
        }
        if cancels(&residues[first..next]) {
            let count = next - first;
            clusters.push(Cluster { first, count });
        }
        first = next;
    }
    clusters
}

fn are_close(a: &ModalTerm, b: &ModalTerm) -> bool {
    let half_widths = a.damping_ratio * a.omega_rad_s + b.damping_ratio * b.omega_rad_s;
    (b.omega_rad_s - a.omega_rad_s).abs() < REACH * half_widths
}

/// Whether residues nearly cancel.
pub(super) fn cancels(residues: &[Complex<f64>]) -> bool {
    let sum: Complex<f64> = residues.iter().sum();
    let magnitudes: f64 = residues.iter().map(|residue| residue.norm()).sum();
    residues.len() > 1 && magnitudes > CANCELLATION * sum.norm()
}

/// The solution with the fewest modes in place of a cluster, if chi^2 does not increase significantly. In place of a cluster of modes that
/// do not describe the data only one or two are tried.
fn with_fewer(problem: Problem<'_>, solution: &Solution, cluster: Cluster) -> Option<Solution> {
    let describes = problem.misfit(solution.chi2) <= MAX_CHI2_PER_FREEDOM;
    let with = |count: usize| with_count(problem, solution, cluster, count);
    let one_or_two = (1..cluster.count.min(PAIR + 1)).find_map(with);
    if one_or_two.is_some() || !describes || cluster.count <= PAIR + 1 {
        return one_or_two;
    }
    // What all modes but one do not describe, fewer do not either.
    let all_but_one = with(cluster.count - 1)?;
    let fewest = (PAIR + 1..cluster.count - 1).find_map(with);
    fewest.or(Some(all_but_one))
}

/// The solution with a number of modes in place of a cluster, if chi^2 does not increase significantly.
fn with_count(
    problem: Problem<'_>,
    solution: &Solution,
    cluster: Cluster,
    count: usize,
) -> Option<Solution> {
    let significant = problem.significant_decrease(&solution.parameters.residues);
    let limit_per_mode = significant * problem.misfit(solution.chi2);
    let best = best_of(problem, solution, cluster, count)?;
    let removed = (cluster.count - count) as f64;
    (best.chi2 - solution.chi2 <= removed * limit_per_mode).then_some(best)
}

/// The best solution with `count` modes in place of a cluster, from starts at the frequencies of its modes; `None` if its coarse fit
/// does not describe the data.
fn best_of(
    problem: Problem<'_>,
    solution: &Solution,
    cluster: Cluster,
    count: usize,
) -> Option<Solution> {
    let parameters = &solution.parameters;
    let middle_rad_s = cluster.mean_omega_rad_s(parameters);
    let subsets = subsets(cluster.count, count).take(MAX_STARTS);
    let subsets = subsets.map(|kept| only(parameters, cluster, kept));
    let pairs = if count == 2 {
        parameters.with_pair_in_place(cluster.modes())
    } else {
        Vec::new()
    };
    let starts = pairs.into_iter().chain(subsets);
    let coarse = starts.map(|start| refine_near(problem, start, middle_rad_s, TOLERANCE));
    let best = coarse.min_by(|a, b| a.chi2.total_cmp(&b.chi2))?;
    let is_promising = problem.misfit(best.chi2) < PROMISING * problem.misfit(solution.chi2);
    is_promising.then(|| refine(problem, best.parameters, 0.0))
}

/// The subsets of a number of modes with `count` of them, each as a bit mask.
fn subsets(modes: usize, count: usize) -> impl Iterator<Item = u64> {
    let masks = 1..1_u64 << modes;
    masks.filter(move |mask| mask.count_ones() as usize == count)
}

/// The parameters without the modes of a cluster that are not in `kept`.
fn only(parameters: &ModalParameters, cluster: Cluster, kept: u64) -> ModalParameters {
    let is_kept = |k: usize| match k.checked_sub(cluster.first) {
        Some(within) if within < cluster.count => kept >> within & 1 == 1,
        _ => true,
    };
    let kept: Vec<usize> = (0..parameters.modes.len())
        .filter(|k| is_kept(*k))
        .collect();
    parameters.selected(&kept)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FrfDatum;
    use crate::modal::MeasurementChain;
    use crate::modal::Residues;

    fn term(hz: f64, damping_ratio: f64, residue_per_kg: f64) -> ModalTerm {
        ModalTerm {
            omega_rad_s: std::f64::consts::TAU * hz,
            damping_ratio,
            residue_per_kg,
        }
    }

    /// The exact response of modes from 10 to 150 Hz, with a standard deviation of 2e-8.
    fn data(modes: &[ModalTerm]) -> Vec<FrfDatum> {
        let datum = |k: u32| {
            let frequency_hz = 10.0 + 0.07 * f64::from(k);
            let s = Complex::new(0.0, std::f64::consts::TAU * frequency_hz);
            let response = modes
                .iter()
                .map(|mode| mode.resonance(s) * mode.residue_per_kg)
                .sum();
            FrfDatum {
                frequency_hz,
                spread_hz: 0.0,
                response,
                variance: 4e-16,
            }
        };
        (0..2000).map(datum).collect()
    }

    /// The modes that replace those of an exact model of the data.
    fn replaced(modes: &[ModalTerm]) -> Vec<ModalTerm> {
        let (chain, data) = (&MeasurementChain::Direct, &data(modes));
        let nodes = &chain.nodes(data, 0.0);
        let problem = Problem { chain, data, nodes };
        let parameters = ModalParameters {
            modes: modes.to_vec(),
            ..ModalParameters::default()
        };
        let exact = Solution::new(problem, parameters);
        with_fewer_in_clusters(problem, exact).parameters.modes
    }

    /// The residues of the last two modes cancel up to an effect of 0.7 standard deviations of the data around 78.8 Hz.
    #[test]
    fn modes_that_cancel_within_the_noise_are_replaced_by_the_others() {
        let others = [
            term(33.7, 0.0155, 9.4),
            term(78.4, 0.0032, 4.6),
            term(79.1, 0.0075, 7.1),
        ];
        let cancelling = [
            term(78.79, 0.005, 40.0),
            term(78.79 * (1.0 + 4e-9), 0.005, -40.0),
        ];
        let modes = replaced(&[others.as_slice(), &cancelling].concat());
        assert_eq!(modes.len(), 3, "{modes:?}");
        for (mode, other) in modes.iter().zip(&others) {
            let ratio = mode.omega_rad_s / other.omega_rad_s;
            assert!((ratio - 1.0).abs() < 1e-5, "{mode:?}");
            let ratio = mode.residue_per_kg / other.residue_per_kg;
            assert!((ratio - 1.0).abs() < 1e-2, "{mode:?}");
        }
    }

    #[test]
    fn significant_modes_of_opposite_residues_are_kept() {
        let modes = [
            term(30.0, 0.01, 0.5),
            term(80.0, 0.01, 0.1),
            term(81.0, 0.01, -0.1),
        ];
        assert_eq!(replaced(&modes), modes);
    }

    #[test]
    fn only_close_modes_with_residues_that_cancel_are_a_cluster() {
        let real = |modes: &[ModalTerm]| ModalParameters {
            modes: modes.to_vec(),
            ..ModalParameters::default()
        };
        let modes = real(&[
            term(30.0, 0.01, 0.5),
            term(80.0, 0.01, 9.0),
            term(80.5, 0.01, -8.0),
        ]);
        assert_eq!(clusters(&modes), [Cluster { first: 1, count: 2 }]);
        let alike = real(&[term(80.0, 0.01, 9.0), term(80.5, 0.01, 8.0)]);
        assert_eq!(clusters(&alike), []);
        let distant = real(&[term(80.0, 0.001, 9.0), term(82.0, 0.001, -8.0)]);
        assert_eq!(clusters(&distant), []);
        // 9 + 9 j and -8 + 9 j have the sum 1 + 18 j.
        let w = std::f64::consts::TAU * 80.0;
        let complex = ModalParameters {
            residues: Residues::Complex(vec![0.0, 9.0 / w, 9.0 / w]),
            ..modes
        };
        assert_eq!(clusters(&complex), []);
    }
}
