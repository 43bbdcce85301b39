//! Limits of the interlocks.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Limits of the interlocks. A trip sets zero current in the same tick and disables the amplifier.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InterlockSettings {
    /// Largest travel in either direction, in metres.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub soft_limit_m: f64,
    /// Largest age of a reading in seconds.
    #[schemars(range(min = 1e-6, max = 10.0))]
    pub probe_stale_s: f64,
    /// Longest time in seconds for which the reading may stay constant while the current changes.
    #[schemars(range(min = 1e-4, max = 100.0))]
    pub probe_stuck_s: f64,
    /// Change of the current in amperes after which the reading must change.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub probe_stuck_current_a: f64,
    /// Largest distance of the measured current from the range of the commands, in amperes.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub current_error_a: f64,
    /// Length of the window over which commands and measured currents are compared, in seconds; it must exceed the delay of the
    /// amplifier's status.
    #[schemars(range(min = 1e-4, max = 100.0))]
    pub current_error_s: f64,
    /// Residual between measured and modelled position that is always allowed, as a ratio of `soft_limit_m`; half of the modelled
    /// position is added to it. Without it the monitor of the residuals is off, as in recordings of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-6, max = 1.0))]
    pub model_error_ratio: Option<f64>,
    /// Share of the largest modelled position by which the measured and the modelled position may differ in addition; 0.5 if
    /// absent. In closed loop 0.4 of it, a fifth, is used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.05, max = 2.0))]
    pub model_error_share: Option<f64>,
    /// Reason for which the monitor of the residuals is switched off, for example a stage whose model is not known yet.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model_error_off: Option<String>,
    /// Largest number of missed ticks within one second.
    #[schemars(range(min = 0, max = 1000000))]
    pub overruns_per_s: u32,
    /// File that keeps the thermal state of the motor between runs on devices; absent for a file in the state folder of the user
    /// ($XDG_STATE_HOME/bench or ~/.local/state/bench). Users who share a bench must use one file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub heat_file: Option<String>,
}
