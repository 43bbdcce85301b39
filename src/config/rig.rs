//! Motor, amplifier and probe; what device stands behind an interface is in [`super::devices`].

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
    /// Peak force in newtons: a command beyond it trips.
    #[schemars(range(min = 1e-3, max = 1e6))]
    pub peak_force_n: f64,
    /// Continuous force in newtons: the thermal current may not exceed it.
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

/// The current amplifier: the current follows the limited command through a first order lag.
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
    /// From the moment a command is due to the moment its set-point acts, in seconds: bus and drive. Whole periods of
    /// computing stand in `loop.computing_delay_periods`, the current loop's own lag in `bandwidth_hz`.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub latency_s: f64,
    /// What stands behind the interface.
    pub device: AmplifierDevice,
}

/// The displacement probe.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeSettings {
    /// Full range in metres; readings go from minus to plus half of it.
    #[schemars(range(min = 1e-9, max = 1.0))]
    pub range_m: f64,
    /// Readings that arrive in a second, by a clock of the probe's own; absent if each tick has a reading of its very moment.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 1e6))]
    pub rate_hz: Option<f64>,
    /// From a measurement to the moment the probe could tell it (filters, computing), in seconds.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub latency_s: f64,
    /// From that moment to the arrival of the whole reading (request, line), in seconds.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub transport_s: f64,
    /// What stands behind the interface.
    pub device: ProbeDevice,
}

impl ProbeSettings {
    /// Age in seconds of a reading when it arrives.
    pub fn age_at_arrival_s(&self) -> f64 {
        self.latency_s + self.transport_s
    }
}
