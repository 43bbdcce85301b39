//! Start values with one mode at each peak of the response.

use super::candidates::{TRIALS, delays_s};
use super::parameters::{ModalParameters, Residues};
use super::solution::{Problem, Solution, node_responses};
use crate::FrfDatum;
use bench_plant::zeros::ModalTerm;

/// A peak is the largest velocity within this ratio of its frequency.
const REACH: f64 = 0.03;
/// It exceeds the velocity at some frequency within this ratio, on both sides ...
const FOOT: f64 = 0.15;
/// ... by this factor.
const PROMINENCE: f64 = 2.0;
/// A peak exceeds the noise by this factor in power.
const SIGNIFICANT_POWER: f64 = 20.0;
/// Largest number of peaks.
const MAX_PEAKS: usize = 8;
/// Bounds of the damping ratio at the start.
const DAMPING_RATIO: (f64, f64) = (1e-3, 0.06);

/// Modes at the peaks, with the delays of least chi^2; none with fewer than two peaks.
pub(super) fn peak_starts(problem: Problem<'_>, residues: &Residues) -> Vec<ModalParameters> {
    let modes = peaks(problem);
    let [first, _, ..] = modes[..] else {
        return Vec::new();
    };
    let without_modes = ModalParameters::without_modes(residues);
    let start = modes
        .into_iter()
        .fold(without_modes, ModalParameters::with_mode);
    let responses = node_responses(problem, &start);
    let solutions = delays_s(problem.data, first).map(|delay_s| {
        let start = ModalParameters {
            delay_s,
            ..start.clone()
        };
        Solution::of_modes(problem, start, &responses)
    });
    let mut solutions: Vec<Solution> = solutions.collect();
    solutions.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
    solutions.truncate(TRIALS);
    let starts = solutions.into_iter().map(|solution| solution.parameters);
    starts.collect()
}

/// A mode of residue 0 at each peak of |velocity|, lowest frequency first.
fn peaks(problem: Problem<'_>) -> Vec<ModalTerm> {
    let Problem { chain, data, .. } = problem;
    let velocity: Vec<f64> = data.iter().map(|datum| chain.velocity(datum)).collect();
    let mut peaks: Vec<usize> = (0..data.len())
        .filter(|k| is_peak(data, &velocity, *k))
        .collect();
    peaks.sort_by(|a, b| velocity[*b].total_cmp(&velocity[*a]));
    peaks.truncate(MAX_PEAKS);
    peaks.sort_unstable();
    let mode = |k: usize| ModalTerm {
        omega_rad_s: data[k].omega_rad_s(),
        damping_ratio: damping_ratio(data, &velocity, k),
        residue_per_kg: 0.0,
    };
    peaks.into_iter().map(mode).collect()
}

fn is_peak(data: &[FrfDatum], velocity: &[f64], k: usize) -> bool {
    let datum = &data[k];
    if datum.response.norm_sqr() < SIGNIFICANT_POWER * datum.variance {
        return false;
    }
    let is_largest = within(data, k, REACH).all(|j| velocity[j] <= velocity[k]);
    let has_foot = |from_hz: f64, to_hz: f64| {
        let around = within(data, k, FOOT);
        let side = around.filter(|j| (from_hz..=to_hz).contains(&data[*j].frequency_hz));
        side.map(|j| velocity[j]).fold(f64::INFINITY, f64::min) * PROMINENCE < velocity[k]
    };
    let hz = datum.frequency_hz;
    is_largest && has_foot(0.0, hz) && has_foot(hz, f64::INFINITY)
}

/// The indices of the data around one of them.
fn within(data: &[FrfDatum], k: usize, ratio: f64) -> impl Iterator<Item = usize> {
    let hz = data[k].frequency_hz;
    let low = data.partition_point(|datum| datum.frequency_hz < hz * (1.0 - ratio));
    let high = data.partition_point(|datum| datum.frequency_hz <= hz * (1.0 + ratio));
    low..high
}

/// Half of the width over which the squared velocity exceeds half of its peak, as a ratio of frequency.
fn damping_ratio(data: &[FrfDatum], velocity: &[f64], k: usize) -> f64 {
    let limit = velocity[k] / std::f64::consts::SQRT_2;
    let low = (0..k).rev().take_while(|j| velocity[*j] > limit).last();
    let high = (k..data.len()).take_while(|j| velocity[*j] > limit).last();
    let hz = |index: Option<usize>| data[index.unwrap_or(k)].frequency_hz;
    let width_hz = hz(high) - hz(low);
    (0.5 * width_hz / data[k].frequency_hz).clamp(DAMPING_RATIO.0, DAMPING_RATIO.1)
}
