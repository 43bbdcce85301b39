//! A campaign on a stage that a person loads.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a person loads the stage between the points of `bench campaign`, and how that is checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CampaignSettings {
    /// m2/m3 - 1 of the stage with nothing added, as far as it is known.
    #[schemars(range(min = -0.5, max = 0.5))]
    pub built_asymmetry: f64,
    /// Newtons in Y per newton that hangs: the trigonometry of the virtual pulley (section 5.1.3, Fig 5-7).
    #[schemars(range(min = 0.01, max = 100.0))]
    pub pulley_ratio: f64,
    /// By how much the cable may pull beside Y, in radians.
    #[schemars(range(min = 0.0, max = 0.5))]
    pub cable_misalignment_rad: f64,
    /// By how much the mounting of the probe may drift in a session, in metres.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub rest_tolerance_m: f64,
    /// How well the model's frequencies are known, as a ratio.
    #[schemars(range(min = 1e-6, max = 0.5))]
    pub frequency_tolerance_ratio: f64,
    /// Duration of zero current after the operator has touched the stage, in seconds.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub settle_s: f64,
    /// Time over which the place where the stage rests is averaged, in seconds.
    #[schemars(range(min = 0.1, max = 1000.0))]
    pub average_s: f64,
}
