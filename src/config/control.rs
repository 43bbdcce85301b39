//! The closed loop of `bench control`, and what it follows.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The closed loop of `bench control`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlSettings {
    /// `fast`, `slow`, or the path of a TOML file with sections.
    pub controller: String,
    /// A loop with a smaller modulus margin (1/max|S|), or an unstable one, is refused; 0 refuses none.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub least_modulus_margin: f64,
    /// Zero current before the loop closes, in seconds; the mean position over it is the origin of the reference.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub settle_s: f64,
    /// Length of the run after the loop closed, in seconds.
    #[schemars(range(min = 0.001, max = 1000000.0))]
    pub duration_s: f64,
    /// Seconds after the last change of the reference from which on the steady state is measured.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub steady_after_s: f64,
    /// What to follow.
    pub reference: ReferenceSettings,
}

/// A reference, relative to where the stage rests when the loop closes; zero before its start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum ReferenceSettings {
    /// Stay where the loop closed.
    Hold,
    /// A step.
    Step {
        /// Height in metres.
        #[schemars(range(min = -1.0, max = 1.0))]
        amplitude_m: f64,
        /// When, in seconds after the loop closed.
        #[schemars(range(min = 0.0, max = 1000000.0))]
        at_s: f64,
    },
    /// From 0 to a height at a constant speed, then stay.
    Ramp {
        /// Height in metres.
        #[schemars(range(min = -1.0, max = 1.0))]
        amplitude_m: f64,
        /// Speed in metres per second.
        #[schemars(range(min = 1e-12, max = 100.0))]
        speed_m_per_s: f64,
        /// When, in seconds after the loop closed.
        #[schemars(range(min = 0.0, max = 1000000.0))]
        at_s: f64,
    },
    /// A sine that starts at zero.
    Sine {
        /// Amplitude in metres.
        #[schemars(range(min = -1.0, max = 1.0))]
        amplitude_m: f64,
        /// Frequency in hertz, below half the servo rate.
        #[schemars(range(min = 1e-4, max = 50000.0))]
        frequency_hz: f64,
    },
    /// The sweep of `[chirp]` with its quiets, in metres: for identification in closed loop. The run lasts as long as the
    /// sweep, whatever `control.duration_s` says.
    Chirp {
        /// Amplitude over frequency: straight lines on logarithmic axes, constant outside. Without a point it is planned from
        /// the model: the command has the amplitude of `[chirp]` where the stage moves by no more than `travel_m`.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        #[schemars(length(max = 64))]
        amplitude: Vec<TravelPoint>,
        /// Amplitude in metres by which a planned sweep moves the stage at most.
        #[schemars(range(min = 1e-9, max = 1.0))]
        travel_m: f64,
    },
    /// A CSV file with the columns `time_s,reference_m`; straight lines between its points.
    File {
        /// Path of the file.
        path: String,
    },
}

/// The amplitude of a swept reference at a frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TravelPoint {
    /// Frequency in hertz, rising from point to point.
    #[schemars(range(min = 1e-4, max = 1e5))]
    pub frequency_hz: f64,
    /// Amplitude in metres.
    #[schemars(range(min = 1e-12, max = 1.0))]
    pub amplitude_m: f64,
}
