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
//! Takenaka and Malmquist: half of their poles are real, spread over the decades, and half are pairs (Kautz 1954) at the modes and
//! where the bound of the unmodelled modes bends. M has a stable inverse, so that nothing is lost but what the finite number of functions
//! lacks. The frequencies are those of a grid, which makes the bound larger, never smaller.

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

impl ConvexBound {
    /// The bound, whether it has converged, and the share of it that a design attains.
    pub fn sentence(&self, attained: f64) -> String {
        let (limit, half) = (self.limit_rad_s, self.with_half_rad_s);
        let (plant, functions) = (&self.plant, self.functions);
        let percent = 100.0 * attained / limit;
        // The value rises with the number of functions, so only one that hardly changes is a bound.
        let state = if limit / half < CONVERGED {
            "no linear controller of any order attains more".to_string()
        } else {
            format!("not converged ({half:.0} rad/s with half of them), the bound is larger")
        };
        format!(
            "convex bound: {limit:.0} rad/s at {plant} with {functions} functions, {state}; this design attains {percent:.0} % of it"
        )
    }
}

/// Ratio of the values with all and with half of the functions below which the bound does not depend on their number.
const CONVERGED: f64 = 1.05;
/// Numbers of basis functions: of the comparison of the plants, and of the bound.
const FUNCTIONS: (usize, usize) = (30, 60);
/// Relative width of the last interval of the bisection.
const ACCURACY: f64 = 2e-3;
/// A violation of the requirements below this is rounding of the solver.
const FEASIBLE: f64 = 1e-5;
/// The bound of unmodelled modes is left out below this part of |P|: the result is larger, never smaller.
const NEGLIGIBLE: f64 = 0.02;

/// A pole of the basis in the z plane.
#[derive(Clone, Copy, Debug, PartialEq)]
enum BasisPole {
    Real(f64),
    /// A pair by its real part and the square of its magnitude.
    Pair {
        re: f64,
        square: f64,
    },
}

/// The smallest bound of some plants. `None` for the goal [`Goal::Rms`], or if the solver fails.
/// `bends_rad_s`: frequencies where the bound of the unmodelled modes bends.
pub fn convex_bound(
    plants: &[(&DesignPlant, &SampledPlant)],
    bends_rad_s: &[f64],
    requirements: &Requirements,
    attained: f64,
) -> Option<ConvexBound> {
    if requirements.goal == Goal::Rms {
        return None;
    }
    let (few, many) = FUNCTIONS;
    let bounds = plants.iter().filter_map(|(plant, sampled)| {
        let basis = Basis::of(plant, sampled, bends_rad_s, few);
        Some((
            plant,
            sampled,
            basis.largest_target(sampled, requirements, attained)?,
        ))
    });
    let lowest = bounds.min_by(|a, b| a.2.total_cmp(&b.2))?;
    let (plant, sampled, with_half_rad_s) = lowest;
    let basis = Basis::of(plant, sampled, bends_rad_s, many);
    Some(ConvexBound {
        plant: plant.name.clone(),
        limit_rad_s: basis.largest_target(sampled, requirements, with_half_rad_s)?,
        functions: many,
        with_half_rad_s,
    })
}

/// The first plant for which the limits alone, without a goal, have no solution with the full number of basis functions.
/// `None` if there is a solution for each plant alone, or if the solver fails.
pub fn excluded_plant(
    plants: &[(&DesignPlant, &SampledPlant)],
    bends_rad_s: &[f64],
    requirements: &Requirements,
) -> Option<String> {
    const NO_GOAL: f64 = 0.0;
    let excluded = plants.iter().find(|(plant, sampled)| {
        let basis = Basis::of(plant, sampled, bends_rad_s, FUNCTIONS.1);
        let programme = basis.programme(sampled, requirements, NO_GOAL);
        programme.least_violation().is_some_and(|v| v > FEASIBLE)
    });
    excluded.map(|(plant, _)| plant.name.clone())
}

/// The basis functions M phi_n at the frequencies of a grid.
struct Basis {
    /// For each frequency the values of all functions.
    values: Vec<Vec<Complex<f64>>>,
}

impl Basis {
    fn of(
        plant: &DesignPlant,
        sampled: &SampledPlant,
        bends_rad_s: &[f64],
        functions: usize,
    ) -> Basis {
        let period_s = plant.plant.period_s();
        let pairs = functions / 4;
        let mut poles = real_poles(plant, functions - 2 * pairs);
        poles.extend(pole_pairs(plant, bends_rad_s, pairs));
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
            if feasible(middle)? {
                low = middle
            } else {
                high = middle
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
            if bound > NEGLIGIBLE * p.norm() {
                programme.limit_sum(sensitivity, control(bound))
            } else {
                programme.limit(sensitivity)
            }
            if let Some(limit) = requirements.max_control_sensitivity_a_per_m {
                programme.limit(control(1.0 / limit + bound));
            }
        }
        programme
    }
}

/// Real poles of the basis from a tenth of the first mode to half the sampling rate.
fn real_poles(plant: &DesignPlant, functions: usize) -> Vec<BasisPole> {
    let period_s = plant.plant.period_s();
    let high = 0.6 * std::f64::consts::PI / period_s;
    let first = plant.modes.iter().find(|mode| mode.omega_rad_s > 0.0);
    let low = 0.1 * first.map_or(high, |mode| mode.omega_rad_s).min(high);
    let last = functions.saturating_sub(2).max(1) as f64;
    (0..functions.saturating_sub(1))
        .map(|i| low * libm::pow(high / low, i as f64 / last))
        .map(|rate| BasisPole::Real(libm::exp(-rate * period_s)))
        .collect()
}

/// Damping ratios of the pairs, in the order in which they are used.
const PAIR_DAMPING: [f64; 4] = [0.1, 0.3, 0.03, 0.6];

/// Pairs of poles at the modes and at `bends_rad_s`, below half the sampling rate: all frequencies with the first damping ratio, then
/// all with the next one.
fn pole_pairs(plant: &DesignPlant, bends_rad_s: &[f64], count: usize) -> Vec<BasisPole> {
    let period_s = plant.plant.period_s();
    let modes = plant.features().into_iter().map(|(w, _)| w);
    let places = modes.chain(bends_rad_s.iter().copied());
    let places: Vec<f64> = places
        .filter(|w| w * period_s < std::f64::consts::PI)
        .collect();
    let pairs = PAIR_DAMPING
        .iter()
        .flat_map(|zeta| places.iter().map(move |w| (*w, *zeta)));
    pairs
        .take(count)
        .map(|(w, zeta)| pole_pair(w * period_s, zeta))
        .collect()
}

fn pole_pair(angle: f64, damping_ratio: f64) -> BasisPole {
    let radius = libm::exp(-damping_ratio * angle);
    let turn = angle * (1.0 - damping_ratio * damping_ratio).sqrt();
    BasisPole::Pair {
        re: radius * libm::cos(turn),
        square: radius * radius,
    }
}

/// The constant 1, and the functions of Takenaka and Malmquist at z: each is a low pass or a resonance times the all-passes of the
/// poles before it, with which the functions are orthonormal on the unit circle. A real pole a gives sqrt(1 - a^2)/(z - a); a pair with
/// the denominator d = z^2 - 2 re z + square gives sqrt(1 - square^2) (z - b)/d and sqrt((1 - square^2)(1 - b^2))/d, where
/// b = 2 re/(1 + square).
fn orthonormal(poles: &[BasisPole], z: Complex<f64>) -> Vec<Complex<f64>> {
    let mut values = vec![Complex::new(1.0, 0.0)];
    let mut all_pass = Complex::new(1.0, 0.0);
    for pole in poles {
        match *pole {
            BasisPole::Real(a) => {
                values.push(all_pass * (1.0 - a * a).sqrt() / (z - a));
                all_pass *= (-z * a + 1.0) / (z - a);
            }
            BasisPole::Pair { re, square } => {
                let denominator = z * z - z * (2.0 * re) + square;
                let b = 2.0 * re / (1.0 + square);
                let scale = (1.0 - square * square).sqrt();
                values.push(all_pass * (z - b) * scale / denominator);
                values.push(all_pass * (scale * (1.0 - b * b).sqrt()) / denominator);
                all_pass *= (z * z * square - z * (2.0 * re) + 1.0) / denominator;
            }
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn basis_functions_are_orthonormal_on_the_unit_circle() {
        let poles = [
            BasisPole::Real(0.7),
            pole_pair(0.4, 0.1),
            BasisPole::Real(-0.2),
            pole_pair(1.3, 0.5),
        ];
        // The mean over N points equals the integral up to the largest radius, 0.96, to the power of N.
        const POINTS: usize = 2000;
        let values: Vec<Vec<Complex<f64>>> = (0..POINTS)
            .map(|k| std::f64::consts::TAU * k as f64 / POINTS as f64)
            .map(|angle| orthonormal(&poles, Complex::from_polar(1.0, angle)))
            .collect();
        for i in 0..7 {
            for j in 0..7 {
                let products = values.iter().map(|phi| phi[i] * phi[j].conj());
                let mean = products.sum::<Complex<f64>>() / POINTS as f64;
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((mean - expected).norm() < 1e-12, "{i} {j}: {mean}");
            }
        }
    }
}
