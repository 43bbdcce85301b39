//! A step.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::{
    ReferenceContext, ReferenceDesign, ReferenceError, StepOfReference, check_amplitude, um,
};
use crate::waveform::Reference;
use bench_base::finding::Finding;

/// A step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StepReference {
    /// Height in metres.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub amplitude_m: f64,
    /// Time of the step in seconds after the loop closed.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub at_s: f64,
}

impl ReferenceDesign for StepReference {
    fn describe(&self) -> String {
        format!("step of {} at {} s", um(self.amplitude_m), self.at_s)
    }

    fn build(&self, context: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
        Ok(Box::new(Step {
            amplitude_m: self.amplitude_m,
            at_tick: context.ticks(self.at_s),
        }))
    }

    fn check(&self, soft_limit_m: f64, _rate_hz: f64) -> Vec<Finding> {
        check_amplitude(self.amplitude_m, soft_limit_m)
    }

    fn step(&self) -> Option<StepOfReference> {
        Some(StepOfReference {
            height_m: self.amplitude_m,
            at_s: self.at_s,
        })
    }
}

struct Step {
    amplitude_m: f64,
    at_tick: u64,
}

impl Reference for Step {
    fn at_m(&self, tick: u64) -> f64 {
        if tick >= self.at_tick {
            self.amplitude_m
        } else {
            0.0
        }
    }
}
