//! The models of the mechanics and their settings.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A model of the mechanics. A new model is one variant here and one file in `plant/`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "model", rename_all = "snake_case")]
pub enum PlantSettings {
    /// The simple representative 4-DoF mechanism of Eq. (2-5).
    Sr4dof(Sr4dofSettings),
    /// The XY stage of section 2.2.4, 10 degrees of freedom.
    Xy(XySettings),
    /// Masses and springs along one line.
    Lumped(LumpedSettings),
    /// A sum of modes, given one by one.
    Modal(ModalSettings),
}

impl PlantSettings {
    /// The name of the model, as in `plant.model`.
    pub fn model(&self) -> &'static str {
        match self {
            PlantSettings::Sr4dof(_) => "sr4dof",
            PlantSettings::Xy(_) => "xy",
            PlantSettings::Lumped(_) => "lumped",
            PlantSettings::Modal(_) => "modal",
        }
    }

    /// Length of the beams in metres, of a model that has beams.
    pub fn beam_length_m(&self) -> Option<f64> {
        match self {
            PlantSettings::Sr4dof(plant) => Some(plant.beam_length_m),
            PlantSettings::Xy(plant) => Some(plant.beam_length_m),
            PlantSettings::Lumped(_) | PlantSettings::Modal(_) => None,
        }
    }

    /// Static Y displacement of the motion stage in metres, of a model that has an operating point.
    pub fn operating_point_m(&self) -> Option<f64> {
        match self {
            PlantSettings::Sr4dof(plant) => Some(plant.operating_point_m),
            PlantSettings::Xy(plant) => Some(plant.operating_point_m),
            PlantSettings::Lumped(_) | PlantSettings::Modal(_) => None,
        }
    }

    /// Mass asymmetry D = m2/m3 - 1, of the model that has it.
    pub fn mass_asymmetry(&self) -> Option<f64> {
        match self {
            PlantSettings::Sr4dof(plant) => Some(plant.mass_asymmetry),
            PlantSettings::Xy(_) | PlantSettings::Lumped(_) | PlantSettings::Modal(_) => None,
        }
    }

    /// Names of the coordinates of a mode's shape, in their order.
    pub fn coordinates(&self) -> Vec<&str> {
        match self {
            PlantSettings::Sr4dof(_) => vec!["x1", "y1", "y2", "y3"],
            PlantSettings::Xy(_) => {
                vec![
                    "x_ms", "y_ms", "y_sL", "y_sR", "x_sT", "x_sB", "x_gL", "x_gR", "y_gT", "y_gB",
                ]
            }
            PlantSettings::Lumped(plant) => plant.nodes.keys().map(String::as_str).collect(),
            PlantSettings::Modal(plant) => plant.modes.keys().map(String::as_str).collect(),
        }
    }
}

/// The SR4DoF mechanism (Fig 2-2): motion stage 1, secondary stages 2 and 3, intermediate stages 4 and 5.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Sr4dofSettings {
    /// Beam length L in metres.
    #[schemars(range(min = 0.001, max = 1.0))]
    pub beam_length_m: f64,
    /// Beam height H (out of plane) in metres.
    #[schemars(range(min = 0.0001, max = 1.0))]
    pub beam_height_m: f64,
    /// Beam thickness T (in plane) in metres.
    #[schemars(range(min = 0.00001, max = 0.1))]
    pub beam_thickness_m: f64,
    /// Young's modulus E in pascals.
    #[schemars(range(min = 1e6, max = 1e13))]
    pub youngs_modulus_pa: f64,
    /// Poisson ratio nu; the beams' bending stiffness takes the plate modulus E/(1 - nu^2).
    #[schemars(range(min = 0.0, max = 0.5))]
    pub poisson_ratio: f64,
    /// Mass m1 of the motion stage in kilograms.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub motion_stage_mass_kg: f64,
    /// Mass m3 of a secondary stage in kilograms.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub secondary_stage_mass_kg: f64,
    /// Mass m4 = m5 of an intermediate stage in kilograms.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub intermediate_stage_mass_kg: f64,
    /// Stiffness k4 = k5 of each X bearing in newtons per metre.
    #[schemars(range(min = 1e-3, max = 1e9))]
    pub spring_stiffness_n_per_m: f64,
    /// Mass asymmetry D = m2/m3 - 1, a ratio.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub mass_asymmetry: f64,
    /// Static Y displacement Y1o of the motion stage in metres.
    #[schemars(range(min = -0.5, max = 0.5))]
    pub operating_point_m: f64,
    /// Damping of the modes.
    pub damping: DampingSettings,
}

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
    /// Where it was measured, in rad/s.
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub omega_rad_s: f64,
    /// What was measured.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub ratio: f64,
}

/// The XY stage (Fig 1-2a, section 2.2.4): motion stage, four intermediate stages (XL, where the force acts, XR, YT, YB) and
/// eight secondary stages, joined by 16 equal parallelograms.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct XySettings {
    /// Beam length L in metres.
    #[schemars(range(min = 0.001, max = 1.0))]
    pub beam_length_m: f64,
    /// Beam height H (out of plane) in metres.
    #[schemars(range(min = 0.0001, max = 1.0))]
    pub beam_height_m: f64,
    /// Beam thickness T (in plane) in metres.
    #[schemars(range(min = 0.00001, max = 0.1))]
    pub beam_thickness_m: f64,
    /// Young's modulus E in pascals.
    #[schemars(range(min = 1e6, max = 1e13))]
    pub youngs_modulus_pa: f64,
    /// Poisson ratio nu; the beams' bending stiffness takes the plate modulus E/(1 - nu^2).
    #[schemars(range(min = 0.0, max = 0.5))]
    pub poisson_ratio: f64,
    /// Mass of the motion stage in kilograms.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub motion_stage_mass_kg: f64,
    /// Mass of an intermediate stage in kilograms.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub intermediate_stage_mass_kg: f64,
    /// Nominal mass of a secondary stage in kilograms.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub secondary_stage_mass_kg: f64,
    /// What each secondary stage has beyond the nominal mass, as a ratio of it.
    pub secondary_mass_deviation: SecondaryMassDeviation,
    /// On which side of their anchors the secondary stages gT and gB sit.
    pub layout: XyLayout,
    /// Static Y displacement of the motion stage in metres, at X = 0.
    #[schemars(range(min = -0.5, max = 0.5))]
    pub operating_point_m: f64,
    /// Whether the static load of the beams changes the stiffness: a force on YB holds the operating point.
    pub geometric_stiffness: bool,
    /// Damping of the modes.
    pub damping: DampingSettings,
}

/// Deviations of the eight secondary masses by place: s between the motion stage and an intermediate stage, g between ground
/// and an intermediate stage; left, right, top, bottom.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "the names of the drawing")]
pub struct SecondaryMassDeviation {
    /// Motion stage to XL.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub sL: f64,
    /// Motion stage to XR.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub sR: f64,
    /// Motion stage to YT.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub sT: f64,
    /// Motion stage to YB.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub sB: f64,
    /// Ground to XL.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub gL: f64,
    /// Ground to XR.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub gR: f64,
    /// Ground to YT.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub gT: f64,
    /// Ground to YB.
    #[schemars(range(min = -0.9, max = 9.0))]
    pub gB: f64,
}

/// Where the secondary stages gT and gB sit in X beside their anchors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum XyLayout {
    /// gT on the far side of the motor, gB on the near side (s_T = +1, s_B = -1): the same after a quarter turn.
    Pinwheel,
    /// Both away from the motor (s_T = s_B = +1).
    MirrorAway,
    /// Both towards the motor (s_T = s_B = -1).
    MirrorToward,
}

/// Masses that move along one line, and springs between them or to ground. Coordinates in the order of the names.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LumpedSettings {
    /// The masses by name, each with its part in force and displacement.
    pub nodes: BTreeMap<String, NodeSettings>,
    /// The springs by name.
    pub springs: BTreeMap<String, SpringSettings>,
    /// How many bodies hang on no spring to ground; each moves freely, at a frequency of zero.
    #[serde(default)]
    #[schemars(range(min = 0, max = 64))]
    pub free_bodies: usize,
    /// Damping of the modes.
    pub damping: DampingSettings,
}

/// A mass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct NodeSettings {
    /// Mass in kilograms, above zero.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub mass_kg: f64,
    /// Force on it per newton of the actuator.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    pub actuator: f64,
    /// Displacement at the probe per metre of its own.
    #[serde(default)]
    #[schemars(range(min = -1e6, max = 1e6))]
    pub sensor: f64,
}

/// A spring.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpringSettings {
    /// The two ends, each a node or `ground`.
    pub between: [String; 2],
    /// Stiffness in newtons per metre; 0 joins nothing.
    #[schemars(range(min = 0.0, max = 1e12))]
    pub stiffness_n_per_m: f64,
}

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
