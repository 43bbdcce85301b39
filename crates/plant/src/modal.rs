//! A plant given by its modes, G(s) = sum of r/(s^2 + 2 zeta w s + w^2) (Eq. 3-1): one degree of freedom of unit mass for
//! each mode, with sensor weight 1 and the residue as force weight.
//!
//! Coordinates in the order of the modes' names. The effect of floor motion on such a plant is unknown and taken as zero.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{PlantError, PlantModel, Structure};
use bench_base::finding::Finding;

/// A plant as the sum of its modes: G(s) = sum of r/(s^2 + 2 zeta w s + w^2). Coordinates in the order of the names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModalSettings {
    /// The modes by name.
    pub modes: BTreeMap<String, ModeSettings>,
}

/// A mode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ModeSettings {
    /// Undamped natural frequency w in rad/s; 0 is a double integrator.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub omega_rad_s: f64,
    /// Residue r from force to displacement in 1/kg, with its sign.
    #[schemars(range(min = -1e9, max = 1e9))]
    pub residue_per_kg: f64,
    /// Damping ratio zeta.
    #[serde(default)]
    #[schemars(range(min = 0.0, max = 0.99))]
    pub damping_ratio: f64,
}

impl ModalSettings {
    fn vector(&self, of: fn(&ModeSettings) -> f64) -> DVector<f64> {
        DVector::from_iterator(self.modes.len(), self.modes.values().map(of))
    }
}

/// The error of a double integrator with damping.
fn check_damping(name: &str, mode: &ModeSettings) -> Option<Finding> {
    let ratio = mode.damping_ratio;
    (mode.omega_rad_s == 0.0 && ratio != 0.0).then(|| {
        let path = format!("plant.modes.{name}.damping_ratio");
        let what = format!("is {ratio}, but a double integrator has no damping; set 0");
        Finding::new(&path, what)
    })
}

impl PlantModel for ModalSettings {
    fn coordinates(&self) -> Vec<&str> {
        self.modes.keys().map(String::as_str).collect()
    }

    fn check(&self) -> Vec<Finding> {
        let is_silent = self.modes.values().all(|mode| mode.residue_per_kg == 0.0);
        let silent = is_silent.then(|| {
            let what = "have residues of zero only, so no force reaches the probe; give at least one `residue_per_kg`";
            Finding::new("plant.modes", what)
        });
        let modes = self.modes.iter();
        let damped = modes.filter_map(|(name, mode)| check_damping(name, mode));
        silent.into_iter().chain(damped).collect()
    }

    fn undamped(&self) -> Structure {
        let n = self.modes.len();
        let squares = self.vector(|mode| mode.omega_rad_s * mode.omega_rad_s);
        Structure {
            mass: DMatrix::identity(n, n),
            damping: DMatrix::zeros(n, n),
            stiffness: DMatrix::from_diagonal(&squares),
            force: self.vector(|mode| mode.residue_per_kg),
            sensor: DVector::from_element(n, 1.0),
            floor: DVector::zeros(n),
            free_bodies: self
                .modes
                .values()
                .filter(|mode| mode.omega_rad_s == 0.0)
                .count(),
        }
    }

    fn damping(&self, _: &Structure) -> Result<DMatrix<f64>, PlantError> {
        let rates = self.vector(|mode| 2.0 * mode.damping_ratio * mode.omega_rad_s);
        Ok(DMatrix::from_diagonal(&rates))
    }
}
