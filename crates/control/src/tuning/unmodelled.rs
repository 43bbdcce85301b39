//! Bound of modes that the plant's model lacks: their magnitudes add, their phases are unknown.

use crate::features::alias;
use bench_base::units::rad_s;
use bench_plant::UnmodelledMode;
use bench_plant::{LoopPlant, Mode, SignalPath};

/// Points of the table per decade.
const PER_DECADE: f64 = 300.0;
/// Edges of several bounds that differ by less than this ratio are one.
const SAME_EDGE: f64 = 5e-3;

/// The largest magnitude in m/A of the modes that the model lacks, over frequency:
///
/// ```text
///  U(w) = sum over the modes of max |P_j(exp(j w T))|,  each frequency within its tolerance
/// ```
///
/// with hold, amplifier and delays of the signal path.
#[derive(Clone, Debug, Default)]
pub struct UnmodelledBound {
    /// Rising frequencies in rad/s, and the bound at them.
    table: Vec<(f64, f64)>,
    /// Frequency in rad/s and damping ratio at both ends of each tolerance.
    edges: Vec<(f64, f64)>,
}

impl UnmodelledBound {
    /// The bound of some modes whose frequencies are known to `tolerance_ratio`.
    pub fn of(path: &SignalPath, modes: &[UnmodelledMode], tolerance_ratio: f64) -> Self {
        let alone: Vec<Vec<UnmodelledMode>> = modes.iter().map(|mode| vec![*mode]).collect();
        UnmodelledBound::of_groups(path, &alone, tolerance_ratio)
    }

    /// The bound of groups of modes. The modes of a group keep their signs relative to each other, and their frequencies shift together.
    pub fn of_groups(
        path: &SignalPath,
        groups: &[Vec<UnmodelledMode>],
        tolerance_ratio: f64,
    ) -> Self {
        if groups.is_empty() {
            return UnmodelledBound::default();
        }
        let path = path.with_mean_age();
        let edges: Vec<(f64, f64)> = groups
            .iter()
            .flatten()
            .flat_map(|mode| edges(mode, tolerance_ratio))
            .map(|edge| alias(edge, path.period_s))
            .collect();
        let plants: Vec<Vec<LoopPlant>> = groups
            .iter()
            .map(|group| shifted(&path, group, tolerance_ratio))
            .collect();
        let table = frequencies(path.period_s, &edges)
            .into_iter()
            .map(|w| (w, sum_of_largest(&plants, w)))
            .collect();
        UnmodelledBound { table, edges }
    }

    /// The largest of some bounds at each frequency.
    pub fn largest(bounds: &[UnmodelledBound]) -> UnmodelledBound {
        let frequencies = bounds.iter().flat_map(|bound| bound.table.iter());
        let mut grid: Vec<f64> = frequencies.map(|(w, _)| *w).collect();
        grid.sort_by(f64::total_cmp);
        grid.dedup();
        let largest = |w: f64| bounds.iter().map(|bound| bound.at(w)).fold(0.0, f64::max);
        let mut edges: Vec<(f64, f64)> = bounds.iter().flat_map(|bound| bound.edges()).collect();
        edges.sort_by(|a, b| a.0.total_cmp(&b.0));
        edges.dedup_by(|a, b| a.0 < b.0 * (1.0 + SAME_EDGE));
        UnmodelledBound {
            table: grid.into_iter().map(|w| (w, largest(w))).collect(),
            edges,
        }
    }

    /// The bound in m/A at a frequency in rad/s, interpolated.
    pub fn at(&self, omega_rad_s: f64) -> f64 {
        interpolated(&self.table, omega_rad_s)
    }

    /// Frequencies in rad/s and damping ratios where the bound bends.
    pub fn edges(&self) -> Vec<(f64, f64)> {
        self.edges.clone()
    }
}

/// The value of a table of rising frequencies in rad/s, linear between them; that of an end beyond it, 0 without any.
pub(super) fn interpolated(table: &[(f64, f64)], omega_rad_s: f64) -> f64 {
    let after = table.partition_point(|(w, _)| *w < omega_rad_s);
    let after = after.min(table.len().saturating_sub(1));
    match (table.get(after.saturating_sub(1)), table.get(after)) {
        (Some(&(w0, u0)), Some(&(w1, u1))) if w1 > w0 => {
            let share = ((omega_rad_s - w0) / (w1 - w0)).clamp(0.0, 1.0);
            u0 + (u1 - u0) * share
        }
        (_, Some(&(_, bound))) => bound,
        _ => 0.0,
    }
}

fn edges(mode: &UnmodelledMode, tolerance_ratio: f64) -> [(f64, f64); 2] {
    let omega_rad_s = rad_s(mode.frequency_hz);
    [-tolerance_ratio, tolerance_ratio]
        .map(|ratio| (omega_rad_s * (1.0 + ratio), mode.damping_ratio))
}

/// The modes of a group at frequencies over the tolerance, a quarter of the least damping ratio apart: between two of them the magnitude at
/// resonance is at most 1 % larger.
fn shifted(path: &SignalPath, group: &[UnmodelledMode], tolerance_ratio: f64) -> Vec<LoopPlant> {
    let damping = group.iter().map(|mode| mode.damping_ratio);
    let step = 0.25 * damping.fold(1.0, f64::min).max(1e-3);
    let count = libm::ceil(2.0 * tolerance_ratio / step) as usize;
    let ratio = |i: usize| match count {
        0 => 0.0,
        _ => tolerance_ratio * (2.0 * i as f64 / count as f64 - 1.0),
    };
    (0..=count)
        .map(|i| {
            let modes = group.iter().map(|mode| as_mode(mode, 1.0 + ratio(i)));
            let modes: Vec<Mode> = modes.collect();
            LoopPlant::of(path, &modes)
        })
        .collect()
}

fn as_mode(mode: &UnmodelledMode, factor: f64) -> Mode {
    Mode {
        force_gain: mode.residue_per_kg,
        ..Mode::unit(rad_s(mode.frequency_hz) * factor, mode.damping_ratio)
    }
}

fn sum_of_largest(plants: &[Vec<LoopPlant>], omega_rad_s: f64) -> f64 {
    let largest = |shifted: &Vec<LoopPlant>| {
        let magnitudes = shifted.iter().map(|p| p.response(omega_rad_s).norm());
        magnitudes.fold(0.0, f64::max)
    };
    plants.iter().map(largest).sum()
}

/// A logarithmic grid over four decades below half the sampling rate, finer around the edges.
fn frequencies(period_s: f64, edges: &[(f64, f64)]) -> Vec<f64> {
    let nyquist_rad_s = std::f64::consts::PI / period_s * (1.0 - 1e-9);
    let count = (4.0 * PER_DECADE) as i32;
    let even = (0..=count).map(|i| nyquist_rad_s * libm::pow(10.0, -f64::from(i) / PER_DECADE));
    let near = edges
        .iter()
        .flat_map(|(w, zeta)| (-12..=12).map(move |i| w * (1.0 + 0.5 * zeta * f64::from(i))));
    let mut grid: Vec<f64> = even.chain(near).filter(|w| *w <= nyquist_rad_s).collect();
    grid.sort_by(f64::total_cmp);
    grid.dedup();
    grid
}
