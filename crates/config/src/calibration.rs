//! How a calibration is made, and which one is used in runs.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use bench_excitation::StaircaseSteps;

/// The static steps of `bench calibrate`, and its chirp that measures the delay.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalibrateSettings {
    /// Largest current in amperes, in both directions.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub amplitude_a: f64,
    /// Levels on either side of zero.
    #[schemars(range(min = 1, max = 100))]
    pub levels: u32,
    /// Duration of the ramp from one level to the next, in seconds: some periods of the slowest mode, so that the mode is not excited.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub ramp_s: f64,
    /// Settling time after a ramp, in seconds.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub settle_s: f64,
    /// Time in seconds over which a level is averaged.
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub average_s: f64,
    /// Duration in seconds of the chirp that measures the delay. Its band and amplitude are those of `[chirp]`.
    #[schemars(range(min = 1.0, max = 10000.0))]
    pub chirp_duration_s: f64,
    /// The reference for the scale of the probe.
    pub scale_by: ScaleBy,
    /// Largest deviation of a level from a straight line, as a ratio of the whole travel.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub max_nonlinearity_ratio: f64,
    /// Largest difference between rising and falling current, as a ratio of the whole travel.
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

/// The reference for the scale of the probe.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ScaleBy {
    /// None: the scale of the probe is assumed to be correct, and a calibration corrects only its sign and offset.
    Nothing,
    /// The static compliance of the model: a calibration corrects the scale as well.
    Model,
}

/// The calibration that is used in runs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalibrationSettings {
    /// File made by `bench calibrate`; if absent, no calibration is used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Days for which the calibration is valid.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub valid_days: f64,
    /// What happens if it is older.
    pub when_expired: OnInvalidCalibration,
    /// What happens if it was made with other devices.
    pub when_other_devices: OnInvalidCalibration,
    /// Name of the person who confirms gains outside 0.75 to 1.25 (of a reversed probe -1.25 to -0.75), those of a calibration and
    /// of `probe.device.mounting`. Without it, such gains are refused.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accepted_by: Option<String>,
}

/// Largest deviation of a gain from 1 (or -1 for a reversed probe) that needs no confirmation.
const GAIN_TOLERANCE: f64 = 0.25;
/// Smallest magnitude of a gain of the probe, with or without a confirmation.
pub const MIN_PROBE_GAIN: f64 = 0.001;

/// Whether a gain is within 0.75 to 1.25, so that it needs no confirmation.
pub fn is_near_one(gain: f64) -> bool {
    (gain - 1.0).abs() <= GAIN_TOLERANCE
}

impl CalibrationSettings {
    /// The name of the person who confirms unusual gains. A blank text is not a name.
    pub fn confirming_name(&self) -> Option<&str> {
        let name = self.accepted_by.as_deref()?.trim();
        (!name.is_empty()).then_some(name)
    }
}

/// What happens if a calibration is not valid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnInvalidCalibration {
    /// A warning; the run uses it.
    Warn,
    /// The run is refused.
    Refuse,
}
