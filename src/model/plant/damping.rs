//! The damping matrix.

use nalgebra::DMatrix;

use super::linear_algebra::modes;
use super::{PlantError, Structure};
use crate::config::{DampingPoint, DampingSettings};

/// C of a structure: Rayleigh's mass_per_s M + stiffness_s K, or 2 zeta w in every mode.
pub(super) fn matrix(
    structure: &Structure,
    settings: &DampingSettings,
) -> Result<DMatrix<f64>, PlantError> {
    match settings {
        DampingSettings::Rayleigh {
            mass_per_s,
            stiffness_s,
        } => rayleigh(structure, (*mass_per_s, *stiffness_s)),
        DampingSettings::Measured { first, second } => {
            rayleigh(structure, coefficients(first, second))
        }
        DampingSettings::Uniform { ratio } => uniform(structure, *ratio),
    }
}

fn rayleigh(
    structure: &Structure,
    (mass_per_s, stiffness_s): (f64, f64),
) -> Result<DMatrix<f64>, PlantError> {
    if structure.free_bodies > 0 && mass_per_s != 0.0 {
        return Err(PlantError::DampedFreeBody { mass_per_s });
    }
    Ok(mass_per_s * &structure.mass + stiffness_s * &structure.stiffness)
}

/// The two Rayleigh coefficients that give two measured ratios: zeta(w) = mass_per_s/(2 w) + stiffness_s w/2.
fn coefficients(first: &DampingPoint, second: &DampingPoint) -> (f64, f64) {
    let (w1, w2) = (first.omega_rad_s, second.omega_rad_s);
    let stiffness_s = 2.0 * (second.ratio * w2 - first.ratio * w1) / (w2 * w2 - w1 * w1);
    (2.0 * first.ratio * w1 - stiffness_s * w1 * w1, stiffness_s)
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
    fn the_coefficients_give_back_the_measured_ratios() {
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
        let (mass_per_s, stiffness_s) = coefficients(&points[0], &points[1]);
        for point in points {
            let ratio =
                mass_per_s / (2.0 * point.omega_rad_s) + stiffness_s * point.omega_rad_s / 2.0;
            assert!((ratio - point.ratio).abs() < 1e-15, "{ratio}");
        }
        // Both terms are needed: with stiffness alone the upper ratio would be the larger.
        assert!(mass_per_s > 0.0 && stiffness_s > 0.0);
    }
}
