//! The verification of a design: stability from the poles of the closed loop, and margins on a fine grid.

use nalgebra::Complex;
use serde::Serialize;

use super::cascade::Cascade;
use super::classical_margins::{gain_margin, phase_margin_deg};
use super::disturbance::Disturbance;
use super::plant::DesignPlant;
use super::requirement::{sensitivity_bandwidth_rad_s, slope_bandwidth_rad_s};
use super::sampled::{SampledPlant, Spacing, warped};
use super::unmodelled::UnmodelledBound;
use super::variance::{current_sigma_a, sigma_m};
use crate::StateSpace;
use crate::features;
use crate::landmarks::lowest;
use bench_base::units::UM_PER_M;

/// Figures of the loop with one plant, with the modes that its model lacks at their most unfavourable phase.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PlantFigures {
    /// Name of the plant.
    pub plant: String,
    /// Whether all poles of the sampled closed loop lie inside the unit circle.
    pub stable: bool,
    /// Smallest |1 + L| - |C| U.
    pub modulus_margin: f64,
    /// Frequency in rad/s of the smallest one.
    pub modulus_margin_at_rad_s: f64,
    /// Largest ws with |S(jw)| <= w/(sqrt(2) ws) for all w <= ws.
    pub slope_bandwidth_rad_s: f64,
    /// Lowest frequency at which |S| rises through 1/sqrt(2).
    pub sensitivity_bandwidth_rad_s: f64,
    /// |S| at 10 rad/s.
    pub sensitivity_at_10_rad_s: f64,
    /// Largest |K S| in A/um.
    pub control_sensitivity_a_per_um: f64,
    /// Standard deviation of the error in metres under the disturbance and the noise; `None` for a measured plant, whose disturbance is
    /// not known.
    pub error_rms_m: Option<f64>,
    /// Standard deviation of the current in A under the same.
    pub current_rms_a: Option<f64>,
    /// Smallest factor above 1 by which L may grow before it reaches -1, without the modes that the model lacks.
    pub gain_margin: Option<f64>,
    /// Smallest angle between L and -1 where |L| = 1, without the modes that the model lacks.
    pub phase_margin_deg: Option<f64>,
}

/// Local minima of |1 + L| - |C| U above the smallest one by more than this ratio are not refined.
const NEAR_LOWEST: f64 = 1.02;

/// The plants on fine grids that also follow the zeros and poles of the controller and the poles of the closed loop. The points at which
/// |1 + L| - |C| U is smallest are among them, so that nothing lower is between two points.
pub fn fine_samples(
    plants: &[DesignPlant],
    bound: &UnmodelledBound,
    disturbance: &Disturbance,
    cascade: &Cascade,
) -> Vec<SampledPlant> {
    let sampled = plants.iter().map(|plant| {
        let mut features = loop_pairs(plant, cascade);
        features.extend(disturbance.features());
        let sampled = SampledPlant::of(plant, bound, Spacing::Fine, &features);
        let minima = minima_rad_s(plant, bound, &sampled, cascade);
        with_variances(
            sampled.with_points(plant, bound, minima),
            plant,
            disturbance,
        )
    });
    sampled.collect()
}

/// Frequency and damping ratio of the resonances of the controller and of the closed loop with a plant.
pub fn loop_pairs(plant: &DesignPlant, cascade: &Cascade) -> Vec<(f64, f64)> {
    let period_s = plant.plant.period_s();
    let pairs = cascade.pairs().into_iter();
    let controller = pairs.filter_map(|pair| features::by_tustin(pair, period_s));
    let poles = closed_poles(plant, cascade).unwrap_or_default();
    let poles = poles
        .into_iter()
        .filter_map(|z| features::of_root(z, period_s));
    features::distinct(controller.chain(poles))
}

/// The frequencies in rad/s of the lowest minima of |1 + L| - |C| U, each between the neighbours of a point of the grid.
fn minima_rad_s(
    plant: &DesignPlant,
    bound: &UnmodelledBound,
    sampled: &SampledPlant,
    cascade: &Cascade,
) -> Vec<f64> {
    let period_s = plant.plant.period_s();
    let distance = |w: f64| {
        let controller = cascade.response(warped(w, period_s));
        let unmodelled = bound.at(w) + plant.uncertainty.at(w);
        (plant.plant.response(w) * controller + 1.0).norm() - controller.norm() * unmodelled
    };
    let grid = &sampled.omega_rad_s;
    let on_grid: Vec<f64> = (0..grid.len())
        .map(|i| {
            let controller = cascade.response(sampled.warped[i]);
            let difference = sampled.response[i] * controller + 1.0;
            difference.norm() - controller.norm() * sampled.unmodelled[i]
        })
        .collect();
    let least = on_grid.iter().copied().fold(f64::INFINITY, f64::min);
    let inner = 1..grid.len().saturating_sub(1);
    let minima = inner.filter(|&i| {
        let here = on_grid[i];
        here <= least.abs() * (NEAR_LOWEST - 1.0) + least
            && here <= on_grid[i - 1]
            && here <= on_grid[i + 1]
    });
    minima
        .map(|i| lowest(&distance, &grid[i - 1..=i + 1]).rad_s)
        .filter(|w| w.is_finite())
        .collect()
}

/// The sampled plant with the variances of disturbance and noise.
pub fn with_variances(
    sampled: SampledPlant,
    plant: &DesignPlant,
    disturbance: &Disturbance,
) -> SampledPlant {
    let period_s = plant.plant.period_s();
    let variances = disturbance.variances(&plant.modes, &sampled.omega_rad_s, period_s);
    SampledPlant {
        variances,
        ..sampled
    }
}

/// The figures of each plant; `fine` are the plants of [`fine_samples`].
pub fn figures(
    plants: &[DesignPlant],
    fine: &[SampledPlant],
    cascade: &Cascade,
) -> Vec<PlantFigures> {
    let pairs = plants.iter().zip(fine);
    pairs
        .map(|(plant, fine)| PlantFigures::of(plant, fine, cascade))
        .collect()
}

impl PlantFigures {
    fn of(plant: &DesignPlant, fine: &SampledPlant, cascade: &Cascade) -> PlantFigures {
        let grid = &fine.omega_rad_s;
        let controller = fine.warped.iter().map(|s| cascade.response(*s));
        let controller: Vec<_> = controller.collect();
        let products = fine.response.iter().zip(&controller);
        let open_loop: Vec<_> = products.map(|(p, c)| p * c).collect();
        let points = 0..grid.len();
        let distances: Vec<f64> = points
            .map(|i| (open_loop[i] + 1.0).norm() - controller[i].norm() * fine.unmodelled[i])
            .collect();
        let lowest = (0..grid.len()).min_by(|a, b| distances[*a].total_cmp(&distances[*b]));
        let lowest = lowest.unwrap_or(0);
        let at_10 = grid.partition_point(|w| *w < 10.0).min(grid.len() - 1);
        let control = controller.iter().zip(&distances);
        let control = control.map(|(c, distance)| c.norm() / distance / UM_PER_M);
        let is_disturbance_known = plant.uncertainty.is_none();
        PlantFigures {
            plant: plant.name.clone(),
            stable: is_stable(plant, cascade),
            modulus_margin: distances[lowest],
            modulus_margin_at_rad_s: grid[lowest],
            slope_bandwidth_rad_s: slope_bandwidth_rad_s(grid, distances.iter().copied()),
            sensitivity_bandwidth_rad_s: sensitivity_bandwidth_rad_s(
                grid,
                distances.iter().copied(),
            ),
            sensitivity_at_10_rad_s: 1.0 / distances[at_10],
            control_sensitivity_a_per_um: control.fold(0.0, f64::max),
            error_rms_m: is_disturbance_known.then(|| sigma_m(fine, cascade)),
            current_rms_a: is_disturbance_known.then(|| current_sigma_a(fine, cascade)),
            gain_margin: gain_margin(&open_loop),
            phase_margin_deg: phase_margin_deg(&open_loop),
        }
    }
}

/// Whether all poles of the sampled closed loop lie inside the unit circle.
fn is_stable(plant: &DesignPlant, cascade: &Cascade) -> bool {
    let poles = closed_poles(plant, cascade);
    poles.is_some_and(|poles| poles.iter().all(|pole| pole.norm() < 1.0))
}

/// Poles z of the sampled closed loop. `None` if they cannot be computed.
pub fn closed_poles(plant: &DesignPlant, cascade: &Cascade) -> Option<Vec<Complex<f64>>> {
    let period_s = plant.plant.period_s();
    let sections = cascade.sections();
    let biquads = sections
        .iter()
        .map(|section| section.section().tustin(period_s));
    let controller = biquads.fold(StateSpace::gain(UM_PER_M), |law, biquad| {
        law.then(&StateSpace::from(&biquad))
    });
    let (a, b, c) = plant.plant.state_space();
    let plant = StateSpace { a, b, c, d: 0.0 };
    controller.then(&plant).closed_poles()
}
