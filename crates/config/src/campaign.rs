//! A campaign on a stage that an operator loads.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the operator loads the stage between the points of `bench campaign`, and how the load is checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CampaignSettings {
    /// m2/m3 - 1 of the stage without added masses, as far as it is known.
    #[schemars(range(min = -0.5, max = 0.5))]
    pub built_asymmetry: f64,
    /// Force in Y per force of the hanging weight, by the geometry of the virtual pulley (section 5.1.3, Fig 5-7).
    #[schemars(range(min = 0.01, max = 100.0))]
    pub pulley_ratio: f64,
    /// Largest angle between the cable and Y, in radians.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub cable_misalignment_rad: f64,
    /// Largest drift of the mounting of the probe during a session, in metres.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub rest_tolerance_m: f64,
    /// Uncertainty of the frequencies of the model, as a ratio.
    #[schemars(range(min = 1e-6, max = 0.5))]
    pub frequency_tolerance_ratio: f64,
    /// Time with zero current after the operator has touched the stage, in seconds.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub settle_s: f64,
    /// Time over which the rest position is averaged, in seconds.
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub average_s: f64,
}
