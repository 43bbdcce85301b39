//! The damping matrix.

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::linear_algebra::modes;
use super::{PlantError, Structure};

/// Damping, proportional to mass and stiffness or the same in every mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum DampingSettings {
    /// Rayleigh damping through two measured ratios: zeta(w) = mass_per_s/(2 w) + stiffness_s w/2.
    Measured {
        /// The lower of the two.
        first: DampingPoint,
        /// The upper of the two.
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
