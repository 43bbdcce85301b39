//! A sine.

use std::f64::consts::TAU;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::{
    ReferenceContext, ReferenceDesign, ReferenceError, check_amplitude, check_frequency, um,
};
use crate::excitation::waveform::Reference;
use crate::util::finding::Finding;

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
    fn name(&self) -> &'static str {
        "sine"
    }

    fn describe(&self) -> String {
        format!(
            "sine of {} at {} Hz",
            um(self.amplitude_m),
            self.frequency_hz
        )
    }

    fn build(&self, context: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
        Ok(Box::new(Sine {
            amplitude_m: self.amplitude_m,
            cycles_per_tick: self.frequency_hz * context.period_s,
        }))
    }

    fn check(&self, soft_limit_m: f64, rate_hz: f64) -> Vec<Finding> {
        let mut findings = check_amplitude(self.amplitude_m, soft_limit_m);
        findings.extend(check_frequency(self.frequency_hz, rate_hz));
        findings
    }

    fn sine_hz(&self) -> Option<f64> {
        Some(self.frequency_hz)
    }
}

struct Sine {
    amplitude_m: f64,
    cycles_per_tick: f64,
}

impl Reference for Sine {
    fn at_m(&self, tick: u64) -> f64 {
        let cycles = tick as f64 * self.cycles_per_tick;
        self.amplitude_m * libm::sin(TAU * (cycles - libm::floor(cycles)))
    }
}
