//! Properties of the simulated rig that are not in the model of the plant.

use bench_plant::{FloorLine, UnmodelledMode};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The constraints of the simulated stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Geometry {
    /// Linearised at the operating point, as in the model.
    #[default]
    Linear,
    /// Quadratic, x_i - x_j = -0.6 (y_i - y_j)^2/L: the response depends on the amplitude. Only for the plant `sr4dof`.
    Quadratic,
}

/// Properties of the simulated rig that are not in the model of the plant.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SimSettings {
    /// The constraints of the simulated stage, linearised or not.
    #[serde(default)]
    pub geometry: Geometry,
    /// Mass asymmetry m2/m3 - 1 of the simulated stage in addition to `plant.mass_asymmetry`: an initial asymmetry by manufacture
    /// (section 5.2.2) that is unknown to the analysis. Only for the plant `sr4dof`.
    #[serde(default)]
    #[schemars(range(min = -0.5, max = 0.5))]
    pub asymmetry_offset: f64,
    /// Frequencies of the modes of the simulated stage over those of the model, which does not contain this ratio: a tolerance of the
    /// stiffness. The modes of `unmodelled` keep their frequencies. Only for linear geometry.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    #[schemars(range(min = 0.5, max = 2.0))]
    pub frequency_ratio: f64,
    /// Seed of noise and disturbances.
    #[schemars(range(min = 0, max = 9223372036854775807i64))]
    pub seed: u64,
    /// RMS of the white noise of a reading, in metres.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub probe_noise_rms_m: f64,
    /// Quantisation of the probe in metres; 0 for none.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub probe_quantisation_m: f64,
    /// Mechanical stop on either side, in metres.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub stop_m: f64,
    /// Stiffness of the stop in newtons per metre.
    #[schemars(range(min = 0.0, max = 1e9))]
    pub stop_stiffness_n_per_m: f64,
    /// Damping of the stop in newton-seconds per metre.
    #[schemars(range(min = 0.0, max = 1e6))]
    pub stop_damping_n_s_per_m: f64,
    /// Modes of the rig that are not in the model of the plant.
    pub unmodelled: Vec<UnmodelledMode>,
    /// Lines of the acceleration of the floor in X.
    pub floor: Vec<FloorLine>,
}

fn one() -> f64 {
    1.0
}

fn is_one(ratio: &f64) -> bool {
    *ratio == 1.0
}
