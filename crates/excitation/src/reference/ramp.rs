//! A ramp to a height.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::{ReferenceContext, ReferenceDesign, ReferenceError, check_amplitude, um};
use crate::waveform::Reference;
use bench_base::finding::Finding;

/// From 0 to a height at a constant speed, then constant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RampReference {
    /// Height in metres.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub amplitude_m: f64,
    /// Speed in metres per second.
    #[schemars(range(min = 1e-12, max = 100.0))]
    pub speed_m_per_s: f64,
    /// Start in seconds after the loop closed.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub at_s: f64,
}

impl ReferenceDesign for RampReference {
    fn describe(&self) -> String {
        let (height, speed) = (um(self.amplitude_m), um(self.speed_m_per_s));
        format!("ramp to {height} at {speed}/s from {} s", self.at_s)
    }

    fn build(&self, context: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
        let speed_m_per_s = self.speed_m_per_s.abs().copysign(self.amplitude_m);
        Ok(Box::new(Ramp {
            amplitude_m: self.amplitude_m,
            slope_m: speed_m_per_s * context.period_s,
            at_tick: context.ticks(self.at_s),
        }))
    }

    fn check(&self, soft_limit_m: f64, _rate_hz: f64) -> Vec<Finding> {
        check_amplitude(self.amplitude_m, soft_limit_m)
    }

    fn last_change_s(&self) -> f64 {
        self.at_s + self.amplitude_m.abs() / self.speed_m_per_s
    }
}

struct Ramp {
    amplitude_m: f64,
    slope_m: f64,
    at_tick: u64,
}

impl Reference for Ramp {
    fn at_m(&self, tick: u64) -> f64 {
        let distance_m = tick.saturating_sub(self.at_tick) as f64 * self.slope_m;
        if distance_m.abs() < self.amplitude_m.abs() {
            distance_m
        } else {
            self.amplitude_m * f64::from(u8::from(tick >= self.at_tick))
        }
    }
}
