//! Models of the mechanics, with their settings.
//!
//! ```text
//!  settings -> Structure (M, C, K, vectors) -> modes (ModalModel) -> simulation, FRF, margins
//!                          |                            |
//!                          v                            v
//!                       zeros (zeros)                loci that veer or cross, tolerances (of the crates above)
//! ```
//!
//! | `plant.model` | file | source |
//! |---|---|---|
//! | `sr4dof` | `sr4dof.rs` | its four parallelograms, Eq. (2-5) |
//! | `xy` | `xy.rs` | its sixteen parallelograms, section 2.2.4 |
//! | `lumped` | `lumped.rs` | named masses and springs: sections 4.4.1 and 4.4.3, Fig 4-3, or a stage of your own |
//! | `modal` | `modal.rs` | residues, frequencies and damping ratios: Eqs. (3-3) to (3-15), (6-1), (6-3) |
//!
//! A new model is one file with its settings and their `PlantModel`, and one line in `plant_models!` below; a model of another crate
//! is added by [`register_plant`]. To the rest of
//! the program it is a [`Structure`]. `docs/own-stage.md` shows how to describe a stage as masses and springs without
//! any code.
//!
//! Signs: positive current gives positive force, positive force gives positive displacement at low frequency.

#![deny(unsafe_code)]

mod beam;
mod coordinate;
mod damping;
mod discrete;
mod error;
mod input_kind;
mod lifted;
pub mod linear_algebra;
mod loop_plant;
mod lumped;
mod matrix_exponential;
mod modal;
mod modes;
mod output_kind;
mod own;
mod path_responses;
mod port;
mod quadratic;
mod sr4dof;
mod structure;
#[cfg(test)]
mod test_profile;
mod unmodelled;
mod xy;
pub mod zeros;

use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use damping::damping_matrix;
pub use damping::{DampingPoint, DampingSettings};
pub use discrete::{DiscreteMode, DiscretePlant, PlantState};
pub use error::PlantError;
pub use input_kind::InputKind;
pub use loop_plant::{LoopPlant, LoopPlantState, SignalPath};
pub use lumped::{LumpedSettings, NodeSettings, SpringSettings};
pub use matrix_exponential::matrix_exponential;
pub use modal::{ModalSettings, ModeSettings};
pub use modes::{FAR_RAD_S, ModalModel, Mode, Sign};
pub use output_kind::OutputKind;
pub use own::{OwnPlant, register_plant};
pub use path_responses::PathResponses;
pub use port::{Port, PortWeights};
pub use quadratic::{Disturbance, QuadraticSr4dof, QuadraticState};
pub use sr4dof::Sr4dofSettings;
pub use structure::{Assembly, Structure};
pub use unmodelled::{FloorLine, UnmodelledMode};
pub use xy::{SecondaryMassDeviation, XyLayout, XySettings};

use bench_base::finding::Finding;
use bench_base::numeric::to_four_decimals;

/// The settings of a model of the mechanics. This trait provides everything in which the models differ.
pub trait PlantModel: Send + Sync {
    /// Names of the coordinates of a mode's shape, in their order.
    fn coordinates(&self) -> Vec<&str>;

    /// Length of the beams in metres, of a model that has them: 100 % of an operating point.
    fn beam_length_m(&self) -> Option<f64> {
        None
    }

    /// Static Y displacement of the motion stage in metres, of a model with an operating point.
    fn operating_point_m(&self) -> Option<f64> {
        None
    }

    /// Mass asymmetry D = m2/m3 - 1, of a model that has it.
    fn mass_asymmetry(&self) -> Option<f64> {
        None
    }

    /// Errors in the relations between settings, each of which is within its range.
    fn check(&self) -> Vec<Finding> {
        Vec::new()
    }

    /// The structure with C = 0.
    fn undamped(&self) -> Structure;

    /// The settings of the damping.
    fn damping_settings(&self) -> Option<&DampingSettings> {
        None
    }

    /// C of the undamped structure: that of the damping settings; zero without them.
    fn damping(&self, undamped: &Structure) -> Result<DMatrix<f64>, PlantError> {
        match self.damping_settings() {
            Some(settings) => damping_matrix(undamped, settings),
            None => Ok(undamped.damping.clone()),
        }
    }

    /// Places where a force may act and a probe may measure, in the model's order.
    fn ports(&self) -> Vec<Port> {
        Vec::new()
    }
}

/// Registers the models: the variant of [`PlantSettings`], its settings, and its name in `plant.model`.
macro_rules! plant_models {
    ($($(#[$doc:meta])* $variant:ident($settings:ident) = $name:literal,)*) => {
        /// The settings of a model of the mechanics.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "model")]
        #[schemars(transform = bench_base::kinds::list_added_kinds)]
        pub enum PlantSettings {
            $(
                $(#[$doc])*
                #[serde(rename = $name)]
                $variant($settings),
            )*
            /// A model of another crate.
            #[serde(untagged)]
            Own(OwnPlant),
        }

        /// The names of the models of this crate.
        const MODELS: &[&str] = &[$($name,)*];

        impl PlantSettings {
            /// The name of the model, as in `plant.model`.
            pub fn model(&self) -> &'static str {
                match self {
                    $(PlantSettings::$variant(_) => $name,)*
                    PlantSettings::Own(own) => own.kind(),
                }
            }

            fn as_model(&self) -> &dyn PlantModel {
                match self {
                    $(PlantSettings::$variant(settings) => settings,)*
                    PlantSettings::Own(own) => &**own,
                }
            }

            /// Settings of the same model from a table without its name. The general way, by the name, copies the whole
            /// table and takes six times as long.
            pub fn with_table(
                &self,
                table: &serde_json::Value,
            ) -> serde_json::Result<PlantSettings> {
                match self {
                    $(PlantSettings::$variant(_) => {
                        $settings::deserialize(table).map(PlantSettings::$variant)
                    })*
                    PlantSettings::Own(own) => own::with_table(own, table).map(PlantSettings::Own),
                }
            }
        }
    };
}

plant_models! {
    /// The simple representative 4-DoF mechanism of Eq. (2-5).
    Sr4dof(Sr4dofSettings) = "sr4dof",
    /// The XY stage of section 2.2.4, 10 degrees of freedom.
    Xy(XySettings) = "xy",
    /// Masses and springs along one line.
    Lumped(LumpedSettings) = "lumped",
    /// A sum of modes, given one by one.
    Modal(ModalSettings) = "modal",
}

impl PlantSettings {
    /// Names of the coordinates of a mode's shape, in their order.
    pub fn coordinates(&self) -> Vec<&str> {
        self.as_model().coordinates()
    }

    /// Length of the beams in metres, of a model with beams.
    pub fn beam_length_m(&self) -> Option<f64> {
        self.as_model().beam_length_m()
    }

    /// Static Y displacement of the motion stage in metres, of a model with an operating point.
    pub fn operating_point_m(&self) -> Option<f64> {
        self.as_model().operating_point_m()
    }

    /// Name of the operating point, as `8 % of L` or `3 mm`; `None` for a model without one.
    pub fn operating_point_name(&self) -> Option<String> {
        let point_m = self.operating_point_m()?;
        Some(match self.beam_length_m() {
            Some(length_m) => format!("{} % of L", to_four_decimals(100.0 * point_m / length_m)),
            None => format!("{} mm", to_four_decimals(1e3 * point_m)),
        })
    }

    /// The same model at another operating point in metres; `None` for a model without one.
    pub fn at_operating_point(&self, point_m: f64) -> Option<PlantSettings> {
        let mut plant = self.clone();
        match &mut plant {
            PlantSettings::Sr4dof(settings) => settings.operating_point_m = point_m,
            PlantSettings::Xy(settings) => settings.operating_point_m = point_m,
            PlantSettings::Lumped(_) | PlantSettings::Modal(_) | PlantSettings::Own(_) => {
                return None;
            }
        }
        Some(plant)
    }

    /// Mass asymmetry D = m2/m3 - 1, of a model that has it.
    pub fn mass_asymmetry(&self) -> Option<f64> {
        self.as_model().mass_asymmetry()
    }

    /// Errors in the relations between settings, each of which is within its range; without those of the damping.
    pub fn check(&self) -> Vec<Finding> {
        let mut findings: Vec<Finding> = self.check_operating_point().into_iter().collect();
        findings.extend(self.as_model().check());
        findings
    }

    /// The error in measured damping ratios that do not determine a positive damping.
    pub fn check_damping(&self) -> Option<Finding> {
        let settings = self.as_model().damping_settings();
        settings.and_then(DampingSettings::check)
    }

    fn check_operating_point(&self) -> Option<Finding> {
        let (point_m, length_m) = (self.operating_point_m()?, self.beam_length_m()?);
        let what =
            format!("is {point_m} m, beyond the length of the beams of {length_m} m; lower it");
        (point_m.abs() > length_m).then(|| Finding::new("plant.operating_point_m", what))
    }
}

/// The structure that the settings describe.
pub fn build(settings: &PlantSettings) -> Result<Structure, PlantError> {
    let undamped = undamped(settings);
    let damping = settings.as_model().damping(&undamped)?;
    Ok(Structure {
        damping,
        ..undamped
    })
}

/// The structure with C = 0, independently of the damping in the settings.
pub fn undamped(settings: &PlantSettings) -> Structure {
    settings.as_model().undamped()
}

/// Places where a force may act on the model and a probe may measure, in the model's order; none for a plant given by its
/// modes.
pub fn ports(settings: &PlantSettings) -> Vec<Port> {
    settings.as_model().ports()
}

#[cfg(test)]
mod tests {
    use super::{build, ports};
    use crate::test_profile::plant_of_profile;
    use nalgebra::DMatrix;

    /// Each stage's mass moves along its ports: together they are the mass matrix.
    #[test]
    fn masses_along_the_ports_sum_to_the_mass_matrix() {
        for (profile, stages) in [
            ("chapter2", ["1", "2", "3", "4", "5"]),
            ("xy", ["ms", "X", "Y", "s", "g"]),
        ] {
            let settings = plant_of_profile(profile, &[]);
            let plant = serde_json::to_value(&settings).unwrap();
            let key = |key: &str| plant[key].as_f64().unwrap();
            let mass_kg = |name: &str| {
                let stage = name.trim_start_matches(['x', 'y']).trim_start_matches('_');
                match *stages
                    .iter()
                    .find(|start| stage.starts_with(**start))
                    .unwrap()
                {
                    "1" | "ms" => key("motion_stage_mass_kg"),
                    "2" => key("secondary_stage_mass_kg") * (1.0 + key("mass_asymmetry")),
                    "3" | "s" | "g" => key("secondary_stage_mass_kg"),
                    _ => key("intermediate_stage_mass_kg"),
                }
            };
            let structure = build(&settings).unwrap();
            let n = structure.mass.nrows();
            let sum = ports(&settings)
                .iter()
                .fold(DMatrix::zeros(n, n), |sum, port| {
                    sum + mass_kg(&port.name) * &port.row * port.row.transpose()
                });
            let error = (&sum - &structure.mass).amax();
            assert!(error < 1e-14 * structure.mass.amax(), "{profile}: {sum}");
        }
    }
}
