//! A triangle wave.
//!
//! ```text
//!  x = f t modulo 1      r = A 4x            for x < 1/4
//!                        r = A (2 - 4x)      for x < 3/4
//!                        r = A (4x - 4)      otherwise            slope +-4 A f
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::{ReferenceContext, ReferenceDesign, ReferenceError, um};
use super::wave::{Wave, check_wave};
use crate::waveform::Reference;
use bench_base::finding::Finding;

/// A triangle wave that starts at zero: constant speed of 4 times amplitude times frequency, in alternating directions.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TriangleReference {
    /// Largest position to either side in metres; the first one has its sign.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub amplitude_m: f64,
    /// Frequency in hertz, below half the servo rate.
    #[schemars(range(min = 1e-4, max = 50000.0))]
    pub frequency_hz: f64,
}

impl TriangleReference {
    /// Speed between two turns in metres per second.
    fn speed_m_per_s(&self) -> f64 {
        4.0 * self.amplitude_m.abs() * self.frequency_hz
    }
}

impl ReferenceDesign for TriangleReference {
    fn describe(&self) -> String {
        let (height, speed) = (um(self.amplitude_m), um(self.speed_m_per_s()));
        let frequency_hz = self.frequency_hz;
        format!("triangle wave of +-{height} at {frequency_hz} Hz, {speed}/s")
    }

    fn build(&self, context: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
        let period_s = context.period_s;
        let wave = Wave::new(self.amplitude_m, self.frequency_hz, period_s, shape);
        Ok(Box::new(wave))
    }

    fn check(&self, soft_limit_m: f64, rate_hz: f64) -> Vec<Finding> {
        check_wave(self.amplitude_m, self.frequency_hz, soft_limit_m, rate_hz)
    }
}

fn shape(x: f64) -> f64 {
    if x < 0.25 {
        4.0 * x
    } else if x < 0.75 {
        2.0 - 4.0 * x
    } else {
        4.0 * x - 4.0
    }
}
