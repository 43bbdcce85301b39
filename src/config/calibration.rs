//! How a calibration is made, and which one runs use.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::excitation::StaircaseSteps;

/// The static steps of `bench calibrate`, and the chirp that it measures the delay by.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalibrateSettings {
    /// Largest current in amperes, to both sides.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub amplitude_a: f64,
    /// Levels on either side of zero.
    #[schemars(range(min = 1, max = 100))]
    pub levels: u32,
    /// Time from a level to the next in seconds: some periods of the slowest mode, so that it is not set swinging.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub ramp_s: f64,
    /// Time in seconds for the stage to come to rest.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub settle_s: f64,
    /// Time in seconds over which a level is averaged.
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub average_s: f64,
    /// Length in seconds of the chirp that the delay is measured by; its band and amplitude are those of `[chirp]`.
    #[schemars(range(min = 1.0, max = 10000.0))]
    pub chirp_duration_s: f64,
    /// By what the probe's scale is known.
    pub scale_by: ScaleBy,
    /// Largest distance of a level from a straight line, as a ratio of the whole travel.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub max_nonlinearity_ratio: f64,
    /// Largest distance between the ways up and down, as a ratio of the whole travel.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub max_hysteresis_ratio: f64,
}

impl CalibrateSettings {
    /// The steps of current.
    pub fn steps(&self) -> StaircaseSteps {
        StaircaseSteps {
            amplitude_a: self.amplitude_a,
            levels: self.levels,
            ramp_s: self.ramp_s,
            settle_s: self.settle_s,
            average_s: self.average_s,
        }
    }
}

/// By what the probe's scale is known.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScaleBy {
    /// By itself: a calibration corrects its sign and offset.
    Nothing,
    /// By the model's static compliance: a calibration corrects its scale as well.
    Model,
}

/// The calibration that runs use.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalibrationSettings {
    /// A file made by `bench calibrate`; none if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Days for which it holds.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub valid_days: f64,
    /// What happens when it is older.
    pub when_expired: OnInvalidCalibration,
    /// What happens when it is of other devices.
    pub when_other_devices: OnInvalidCalibration,
}

/// What happens when a calibration is not fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnInvalidCalibration {
    /// A warning; the run goes on with it.
    Warn,
    /// The run is refused.
    Refuse,
}
