//! The damping matrix.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::linear_algebra::modes;
use super::{PlantError, Structure};
use bench_base::finding::Finding;

/// A coefficient with less than this ratio of the damping is zero except for rounding.
const ROUNDING_RATIO: f64 = 1e-9;

/// Damping, proportional to mass and stiffness or the same in every mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum DampingSettings {
    /// Rayleigh damping through two measured ratios: zeta(w) = mass_per_s/(2 w) + stiffness_s w/2.
    Measured {
        /// One measurement.
        first: DampingPoint,
        /// Another one, at another frequency.
        second: DampingPoint,
    },
    /// Rayleigh damping C = mass_per_s M + stiffness_s K.
    Rayleigh {
        /// Coefficient of the mass matrix in 1/s.
        #[schemars(range(min = 0.0, max = 1e6))]
        mass_per_s: f64,
        /// Coefficient of the stiffness matrix in s.
        #[schemars(range(min = 0.0, max = 1.0))]
        stiffness_s: f64,
    },
    /// The same damping ratio in every mode.
    Uniform {
        /// The ratio.
        #[schemars(range(min = 0.0, max = 0.99))]
        ratio: f64,
    },
}

impl DampingSettings {
    /// Measured ratios that do not determine the damping, or by which the damping of some frequencies is negative.
    pub(super) fn check(&self) -> Option<Finding> {
        let DampingSettings::Measured { first, second } = self else {
            return None;
        };
        if first.omega_rad_s == second.omega_rad_s {
            return Some(one_frequency(first.omega_rad_s));
        }
        let (mass_per_s, stiffness_s) = rayleigh_coefficients(first, second);
        let least = -ROUNDING_RATIO * (first.ratio + second.ratio);
        let is_positive =
            mass_per_s / first.omega_rad_s >= least && stiffness_s * first.omega_rad_s >= least;
        (!is_positive).then(|| negative_damping(first, second))
    }
}

fn one_frequency(omega_rad_s: f64) -> Finding {
    let what = format!(
        "is {omega_rad_s} rad/s, and so is `plant.damping.first.omega_rad_s`: two ratios at the same frequency do not \
         determine the damping; give two different frequencies, or use damping of kind \"uniform\""
    );
    Finding::new("plant.damping.second.omega_rad_s", what)
}

/// Both Rayleigh coefficients are positive where the second ratio lies between z1 w1/w2 and z1 w2/w1.
fn negative_damping(first: &DampingPoint, second: &DampingPoint) -> Finding {
    let (z1, z2) = (first.ratio, second.ratio);
    let (w1, w2) = (first.omega_rad_s, second.omega_rad_s);
    let spread = (w1 / w2).max(w2 / w1);
    let (low, high) = (z1 / spread, z1 * spread);
    let what = format!(
        "is {z2} at {w2} rad/s, with a first ratio of {z1} at {w1} rad/s: the damping of some frequencies would be \
         negative; give a ratio from {low:.4e} to {high:.4e}, or frequencies that are further apart"
    );
    Finding::new("plant.damping.second.ratio", what)
}

/// A damping ratio measured at a frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct DampingPoint {
    /// Frequency of the measurement, in rad/s.
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub omega_rad_s: f64,
    /// The measured damping ratio.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub ratio: f64,
}

/// C of a structure: Rayleigh's mass_per_s M + stiffness_s K, or 2 zeta w in every mode.
pub(super) fn damping_matrix(
    structure: &Structure,
    settings: &DampingSettings,
) -> Result<DMatrix<f64>, PlantError> {
    match settings {
        DampingSettings::Rayleigh {
            mass_per_s,
            stiffness_s,
        } => rayleigh(structure, *mass_per_s, *stiffness_s),
        DampingSettings::Measured { first, second } => {
            let (mass_per_s, stiffness_s) = rayleigh_coefficients(first, second);
            rayleigh(structure, mass_per_s, stiffness_s)
        }
        DampingSettings::Uniform { ratio } => uniform(structure, *ratio),
    }
}

fn rayleigh(
    structure: &Structure,
    mass_per_s: f64,
    stiffness_s: f64,
) -> Result<DMatrix<f64>, PlantError> {
    if structure.free_bodies > 0 && mass_per_s != 0.0 {
        return Err(PlantError::DampedFreeBody { mass_per_s });
    }
    Ok(mass_per_s * &structure.mass + stiffness_s * &structure.stiffness)
}

/// The two Rayleigh coefficients that give two measured ratios: zeta(w) = mass_per_s/(2 w) + stiffness_s w/2.
fn rayleigh_coefficients(first: &DampingPoint, second: &DampingPoint) -> (f64, f64) {
    let (w1, w2) = (first.omega_rad_s, second.omega_rad_s);
    let stiffness_s = 2.0 * (second.ratio * w2 - first.ratio * w1) / (w2 * w2 - w1 * w1);
    let mass_per_s = 2.0 * first.ratio * w1 - stiffness_s * w1 * w1;
    (mass_per_s, stiffness_s)
}

/// C = M V diag(2 zeta w) V^T M with V^T M V = I.
fn uniform(structure: &Structure, ratio: f64) -> Result<DMatrix<f64>, PlantError> {
    let (values, shapes) = modes(&structure.mass, &structure.stiffness)?;
    let mass_shapes = &structure.mass * &shapes;
    let rates = DMatrix::from_diagonal(&values.map(|w2| 2.0 * ratio * w2.max(0.0).sqrt()));
    Ok(&mass_shapes * rates * mass_shapes.transpose())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rayleigh_coefficients_reproduce_the_measured_ratios() {
        let points = [
            DampingPoint {
                omega_rad_s: 179.0,
                ratio: 0.009,
            },
            DampingPoint {
                omega_rad_s: 520.0,
                ratio: 0.004,
            },
        ];
        let (mass_per_s, stiffness_s) = rayleigh_coefficients(&points[0], &points[1]);
        for point in points {
            let w = point.omega_rad_s;
            let ratio = mass_per_s / (2.0 * w) + stiffness_s * w / 2.0;
            assert!((ratio - point.ratio).abs() < 1e-15, "{ratio}");
        }
        // Both terms are needed: with stiffness alone the upper ratio would be the larger.
        assert!(mass_per_s > 0.0 && stiffness_s > 0.0);
    }
}
