//! How a probe is mounted.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::SerialError;

/// How a probe is mounted: position = gain * (position of the probe) + offset.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mounting {
    /// Metres of the stage per metre of the probe; negative if the probe measures against the direction of positive
    /// force. `bench` refuses a magnitude outside 0.75 to 1.25, unless `calibration.accepted_by` confirms it with a name.
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub gain: f64,
    /// Position of the stage at the zero of the probe, in metres.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub offset_m: f64,
}

impl Default for Mounting {
    /// The position as the probe sends it.
    fn default() -> Self {
        Self {
            gain: 1.0,
            offset_m: 0.0,
        }
    }
}

impl Mounting {
    pub(super) fn check(&self) -> Result<(), SerialError> {
        let (name, value, expected) = if !self.gain.is_normal() {
            ("gain", self.gain, "a finite number other than zero")
        } else if !self.offset_m.is_finite() {
            ("offset_m", self.offset_m, "a finite number of metres")
        } else {
            return Ok(());
        };
        Err(SerialError::Setting {
            name,
            value: value.to_string(),
            expected,
        })
    }
}
