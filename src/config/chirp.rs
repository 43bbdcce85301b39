//! The chirp; its band, quiet, fades and amplitude over frequency are those of every excitation.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How a sweep's frequency runs over time.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum,
)]
#[serde(rename_all = "snake_case")]
pub enum Sweep {
    /// f(t) = f0 + (f1 - f0) t/T.
    Linear,
    /// f(t) = f0 (f1/f0)^(t/T).
    Logarithmic,
}

/// The excitation of `bench chirp`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChirpSettings {
    /// Linear or logarithmic.
    pub sweep: Sweep,
    /// First frequency in hertz.
    #[schemars(range(min = 1e-4, max = 50000.0))]
    pub start_hz: f64,
    /// Last frequency in hertz, below half the servo rate.
    #[schemars(range(min = 1e-4, max = 50000.0))]
    pub stop_hz: f64,
    /// Length of the sweep in seconds.
    #[schemars(range(min = 0.001, max = 100000.0))]
    pub duration_s: f64,
    /// Zero current before the sweep, in seconds.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub quiet_before_s: f64,
    /// Zero current after the sweep, in seconds: long enough for the stage to come to rest.
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub quiet_after_s: f64,
    /// Length of the cosine fade at the start, in seconds.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub fade_in_s: f64,
    /// Length of the cosine fade at the end, in seconds.
    #[schemars(range(min = 0.0, max = 1000.0))]
    pub fade_out_s: f64,
    /// How often the chirp, its quiet included, is run; the analysis takes their mean.
    #[serde(default = "once")]
    #[schemars(range(min = 1, max = 10000))]
    pub repetitions: u32,
    /// Amplitude over frequency: straight lines on logarithmic axes, constant outside; one point is a flat sweep.
    #[schemars(length(min = 1, max = 64))]
    pub amplitude: Vec<AmplitudePoint>,
}

impl ChirpSettings {
    /// The band in hertz, lowest and highest frequency, whichever way the sweep runs.
    pub fn band_hz(&self) -> (f64, f64) {
        (
            self.start_hz.min(self.stop_hz),
            self.start_hz.max(self.stop_hz),
        )
    }
}

fn once() -> u32 {
    1
}

/// The amplitude of the excitation at a frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmplitudePoint {
    /// Frequency in hertz, rising from point to point.
    #[schemars(range(min = 1e-4, max = 1e5))]
    pub frequency_hz: f64,
    /// Amplitude in amperes.
    #[schemars(range(min = 1e-9, max = 1000.0))]
    pub current_a: f64,
}
