//! Motor, amplifier and probe. The devices behind amplifier and probe are in [`super::devices`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::devices::{AmplifierDevice, ProbeDevice};

/// The voice coil motor.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MotorSettings {
    /// Force constant in newtons per ampere; positive current gives positive force.
    #[schemars(range(min = 1e-6, max = 1e4))]
    pub force_constant_n_per_a: f64,
    /// Peak force in newtons: a larger command trips.
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub peak_force_n: f64,
    /// Continuous force in newtons, which limits the thermal current.
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub continuous_force_n: f64,
    /// Thermal time constant of the winding in seconds.
    #[schemars(range(min = 0.01, max = 10000.0))]
    pub thermal_time_constant_s: f64,
}

impl MotorSettings {
    /// The current of the peak force in amperes.
    pub fn peak_current_a(&self) -> f64 {
        self.peak_force_n / self.force_constant_n_per_a
    }

    /// The current of the continuous force in amperes.
    pub fn continuous_current_a(&self) -> f64 {
        self.continuous_force_n / self.force_constant_n_per_a
    }
}

/// The current amplifier: the current follows the limited command with a first-order lag.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmplifierSettings {
    /// Bandwidth of the current loop in hertz.
    #[schemars(range(min = 1.0, max = 1e6))]
    pub bandwidth_hz: f64,
    /// Largest current in amperes.
    #[schemars(range(min = 1e-3, max = 1000.0))]
    pub current_limit_a: f64,
    /// Largest change of the current's set-point in amperes per second.
    #[schemars(range(min = 1e-3, max = 1e9))]
    pub slew_limit_a_per_s: f64,
    /// Delay of bus and drive: from the time at which a command is due to the time at which its set-point takes effect, in seconds.
    /// The computing delay is in `loop.computing_delay_periods`, the lag of the current loop in `bandwidth_hz`.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub latency_s: f64,
    /// The device.
    pub device: AmplifierDevice,
}

/// The displacement probe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeSettings {
    /// Full range in metres; readings are between minus half and plus half of it.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub range_m: f64,
    /// Readings per second, by the clock of the probe; absent if each tick has a reading of the same time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 1e6))]
    pub rate_hz: Option<f64>,
    /// Delay inside the probe (filters, computing), in seconds.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub latency_s: f64,
    /// Delay of the transmission (request, line) until the whole reading has arrived, in seconds.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub transport_s: f64,
    /// The device.
    pub device: ProbeDevice,
}

impl ProbeSettings {
    /// Age in seconds of a reading when it arrives.
    pub fn age_at_arrival_s(&self) -> f64 {
        self.latency_s + self.transport_s
    }
}
