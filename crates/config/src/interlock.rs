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
    /// position is added to it. Without it the monitor of the residuals is off, as in recordings of older versions. With
    /// `model_error_share` it must let the monitor trip within a quarter of the travel limit.
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

/// Share without a setting.
const DEFAULT_SHARE: f64 = 0.5;
/// Factor of the share in a closed loop.
pub const CLOSED_SHARE_FACTOR: f64 = 0.4;
/// Smallest ratio of an oscillation at a modelled mode that passes the low-pass of the closed loop.
const CLOSED_PASS_RATIO: f64 = 0.8;
/// The monitor must trip within this ratio of the travel limit; otherwise it counts as switched off.
pub const MAX_DETECTED_RATIO: f64 = 0.25;

/// The smallest faults that the monitor of the residuals detects, as ratios of the travel limit. With the permitted residual
/// a + b |y_p| of a modelled position y_p, where a = `model_error_ratio` and b = `model_error_share`:
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detection {
    /// Modelled motion at which a position that stays at rest trips (a detached probe, a lost cable): a/(1 - b), infinite from
    /// b = 1 on.
    pub at_rest_ratio: f64,
    /// Deviation from a modelled motion of a quarter of the travel limit that trips in a closed loop (an oscillation that grows):
    /// (a + 0.4 b/4)/0.8.
    pub deviation_ratio: f64,
}

impl Detection {
    /// Whether both faults trip within a quarter of the travel limit.
    pub fn is_effective(&self) -> bool {
        self.at_rest_ratio.max(self.deviation_ratio) <= MAX_DETECTED_RATIO
    }
}

impl InterlockSettings {
    /// The share of the largest modelled position by which measured and modelled position may differ.
    pub fn share_of_model_error(&self) -> f64 {
        self.model_error_share.unwrap_or(DEFAULT_SHARE)
    }

    /// What the monitor of the residuals detects; `None` if it is off.
    pub fn detection(&self) -> Option<Detection> {
        let ratio = self
            .model_error_ratio
            .filter(|_| self.model_error_off.is_none())?;
        let share = self.share_of_model_error();
        let at_rest_ratio = if share < 1.0 {
            ratio / (1.0 - share)
        } else {
            f64::INFINITY
        };
        let allowed_ratio = ratio + CLOSED_SHARE_FACTOR * share * MAX_DETECTED_RATIO;
        Some(Detection {
            at_rest_ratio,
            deviation_ratio: allowed_ratio / CLOSED_PASS_RATIO,
        })
    }
}
