//! What trips.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Limits of the interlocks. A trip sets zero current in the same tick and disables the amplifier.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InterlockSettings {
    /// Travel in either direction, in metres.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub soft_limit_m: f64,
    /// Largest age of a reading in seconds.
    #[schemars(range(min = 1e-6, max = 10.0))]
    pub probe_stale_s: f64,
    /// Longest time in seconds for which a reading may not change while the current does.
    #[schemars(range(min = 1e-4, max = 100.0))]
    pub probe_stuck_s: f64,
    /// The change of current in amperes that a reading must answer.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub probe_stuck_current_a: f64,
    /// How far the current that the amplifier measures may lie from the commands, in amperes.
    #[schemars(range(min = 1e-6, max = 1000.0))]
    pub current_error_a: f64,
    /// Over how long a time in seconds; longer than the amplifier's status is late.
    #[schemars(range(min = 1e-4, max = 100.0))]
    pub current_error_s: f64,
    /// Ticks that may be missed within one second.
    #[schemars(range(min = 0, max = 1000000))]
    pub overruns_per_s: u32,
}
