//! A sine.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::{ReferenceContext, ReferenceDesign, ReferenceError, um};
use super::wave::{Wave, check_wave};
use crate::waveform::Reference;
use bench_base::finding::Finding;

/// A sine that starts at zero.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SineReference {
    /// Amplitude in metres.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub amplitude_m: f64,
    /// Frequency in hertz, below half the servo rate.
    #[schemars(range(min = 1e-4, max = 50000.0))]
    pub frequency_hz: f64,
}

impl ReferenceDesign for SineReference {
    fn describe(&self) -> String {
        format!(
            "sine of {} at {} Hz",
            um(self.amplitude_m),
            self.frequency_hz
        )
    }

    fn build(&self, context: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
        let period_s = context.period_s;
        let wave = Wave::new(self.amplitude_m, self.frequency_hz, period_s, shape);
        Ok(Box::new(wave))
    }

    fn check(&self, soft_limit_m: f64, rate_hz: f64) -> Vec<Finding> {
        check_wave(self.amplitude_m, self.frequency_hz, soft_limit_m, rate_hz)
    }

    fn sine_hz(&self) -> Option<f64> {
        Some(self.frequency_hz)
    }
}

fn shape(x: f64) -> f64 {
    libm::sin(TAU * x)
}
