//! The bound that no linear controller of any order passes with one plant: a convex programme.
//!
//! All stabilising controllers of a stable plant are C = Q/(1 - P Q) with a stable Q (Youla, Jabr and Bongiorno 1976). Then
//! S = 1 - P Q and K S = Q depend linearly on Q, and every requirement is a second-order cone:
//!
//! ```text
//!  modulus margin m, bound U         m |S| + U |Q| <= 1
//!  |S| <= w/(sqrt(2) ws), w <= ws    (sqrt(2) ws/w) |S| + U |Q| <= 1
//!  |S| <= 1/sqrt(2), w <= wb         sqrt(2) |S| + U |Q| <= 1
//!  |S| <= s at one frequency         |S|/s + U |Q| <= 1
//!  |K S| <= c                        |Q|/c + U |Q| <= 1
//! ```
//!
//! Q = M sum of x_n phi_n, where M has the lightly damped poles of the plant as zeros, and the phi_n are the orthonormal functions of
//! Takenaka and Malmquist with real poles spread over the decades. M has a stable inverse, so that nothing is lost but what the finite
//! number of functions lacks. The frequencies are those of a grid, which makes the bound larger, never smaller.

use nalgebra::Complex;
use serde::Serialize;

use super::cone_programme::{ConeProgramme, Term};
use super::plant::DesignPlant;
use super::requirement::{Goal, Requirements};
use super::sampled::SampledPlant;

/// The largest target that a controller of any order attains with one plant.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ConvexBound {
    /// The plant with the smallest bound.
    pub plant: String,
    /// ws or wb in rad/s.
    pub limit_rad_s: f64,
    /// Number of basis functions.
    pub functions: usize,
    /// The bound of the same plant with half of the functions.
    pub with_half_rad_s: f64,
}

/// Numbers of basis functions: of the comparison of the plants, and of the bound.
const FUNCTIONS: (usize, usize) = (30, 60);
/// Relative width of the last interval of the bisection.
const ACCURACY: f64 = 2e-3;
/// A violation of the requirements below this is rounding of the solver.
const FEASIBLE: f64 = 1e-5;
/// The bound of unmodelled modes is left out below this part of |P|: the result is larger, never smaller.
const NEGLIGIBLE: f64 = 0.02;

/// The smallest bound of some plants. `None` for the goal [`Goal::Rms`], or if the solver fails.
pub fn convex_bound(
    plants: &[(&DesignPlant, &SampledPlant)],
    requirements: &Requirements,
    attained: f64,
) -> Option<ConvexBound> {
    if requirements.goal == Goal::Rms {
        return None;
    }
    let (few, many) = FUNCTIONS;
    let bounds = plants.iter().filter_map(|(plant, sampled)| {
        let basis = Basis::of(plant, sampled, few);
        Some((
            plant,
            sampled,
            basis.largest_target(sampled, requirements, attained)?,
        ))
    });
    let lowest = bounds.min_by(|a, b| a.2.total_cmp(&b.2))?;
    let (plant, sampled, with_half_rad_s) = lowest;
    let basis = Basis::of(plant, sampled, many);
    Some(ConvexBound {
        plant: plant.name.clone(),
        limit_rad_s: basis.largest_target(sampled, requirements, with_half_rad_s)?,
        functions: many,
        with_half_rad_s,
    })
}

/// The basis functions M phi_n at the frequencies of a grid.
struct Basis {
    /// For each frequency the values of all functions.
    values: Vec<Vec<Complex<f64>>>,
}

impl Basis {
    fn of(plant: &DesignPlant, sampled: &SampledPlant, functions: usize) -> Basis {
        let period_s = plant.plant.period_s();
        let poles = real_poles(plant, functions);
        let at = |w: &f64| {
            let (sine, cosine) = libm::sincos(w * period_s);
            let z = Complex::new(cosine, sine);
            let inverse = notch(plant, z);
            let values = orthonormal(&poles, z).into_iter();
            values.map(|phi| phi * inverse).collect()
        };
        Basis {
            values: sampled.omega_rad_s.iter().map(at).collect(),
        }
    }

    /// The largest target with a solution, by bisection.
    fn largest_target(
        &self,
        sampled: &SampledPlant,
        requirements: &Requirements,
        start: f64,
    ) -> Option<f64> {
        let feasible = |target: f64| {
            let programme = self.programme(sampled, requirements, target);
            programme.least_violation().map(|v| v <= FEASIBLE)
        };
        let (mut low, mut high) = (start, start);
        while feasible(high)? {
            low = high;
            high *= 1.3;
            if high > *sampled.omega_rad_s.last()? {
                return None;
            }
        }
        while low == high {
            low *= 0.8;
            if feasible(low)? {
                break;
            }
            high = low;
        }
        while high / low - 1.0 > ACCURACY {
            let middle = (low * high).sqrt();
            match feasible(middle)? {
                true => low = middle,
                false => high = middle,
            }
        }
        // The upper end has no solution: the bound.
        Some(high)
    }

    /// The programme whose solution violates the requirements least.
    fn programme(
        &self,
        sampled: &SampledPlant,
        requirements: &Requirements,
        target: f64,
    ) -> ConeProgramme {
        let functions = self.values.first().map_or(0, Vec::len);
        let mut programme = ConeProgramme::new(functions);
        for (point, phi) in self.values.iter().enumerate() {
            let p = sampled.response[point];
            let bound = sampled.unmodelled[point];
            let weight = requirements.sensitivity_weight(&sampled.omega_rad_s, point, target);
            let sensitivity = Term {
                weight,
                constant: Complex::new(1.0, 0.0),
                factors: phi.iter().map(|f| -f * p).collect(),
            };
            let control = |weight| Term {
                weight,
                constant: Complex::new(0.0, 0.0),
                factors: phi.clone(),
            };
            match bound > NEGLIGIBLE * p.norm() {
                true => programme.limit_sum(sensitivity, control(bound)),
                false => programme.limit(sensitivity),
            }
            if let Some(limit) = requirements.max_control_sensitivity_a_per_m {
                programme.limit(control(1.0 / limit + bound));
            }
        }
        programme
    }
}

/// Real poles of the basis from a tenth of the first mode to half the sampling rate, in the z plane.
fn real_poles(plant: &DesignPlant, functions: usize) -> Vec<f64> {
    let period_s = plant.plant.period_s();
    let high = 0.6 * std::f64::consts::PI / period_s;
    let first = plant.modes.iter().find(|mode| mode.omega_rad_s > 0.0);
    let low = 0.1 * first.map_or(high, |mode| mode.omega_rad_s).min(high);
    let last = functions.saturating_sub(2).max(1) as f64;
    (0..functions - 1)
        .map(|i| low * libm::pow(high / low, i as f64 / last))
        .map(|rate| libm::exp(-rate * period_s))
        .collect()
}

/// 1, and the functions sqrt(1 - a_n^2)/(z - a_n) product over j < n of (1 - a_j z)/(z - a_j).
fn orthonormal(poles: &[f64], z: Complex<f64>) -> Vec<Complex<f64>> {
    let mut values = vec![Complex::new(1.0, 0.0)];
    let mut all_pass = Complex::new(1.0, 0.0);
    for a in poles {
        values.push(all_pass * (1.0 - a * a).sqrt() / (z - a));
        all_pass *= (-z * a + 1.0) / (z - a);
    }
    values
}

/// Product over the visible modes of (z^2 - 2 Re(p) z + |p|^2)/(z - exp(-w T))^2 with p the pole of the mode: at the modes as small as
/// the plant is large. Scaled by the static gain of the plant.
fn notch(plant: &DesignPlant, z: Complex<f64>) -> Complex<f64> {
    let period_s = plant.plant.period_s();
    let static_gain = plant.plant.response_at(Complex::new(1.0, 0.0)).re;
    let mut value = Complex::new(1.0 / static_gain, 0.0);
    for (omega_rad_s, damping_ratio) in plant.features() {
        let w = omega_rad_s * period_s;
        let radius = libm::exp(-damping_ratio * w);
        let angle = w * (1.0 - damping_ratio * damping_ratio).sqrt();
        let zeros = z * z - z * (2.0 * radius * libm::cos(angle)) + radius * radius;
        // Poles of damping ratio 1 at the frequency of the mode.
        let pole = z - libm::exp(-w);
        value *= zeros / (pole * pole);
    }
    value
}
