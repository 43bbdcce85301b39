//! A square wave.
//!
//! ```text
//!  r(t) = A (-1)^k,  k = floor(2 f (t - t0))  from t0 on; 0 before
//! ```

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::design::{ReferenceContext, ReferenceDesign, ReferenceError, um};
use super::wave::check_wave;
use crate::waveform::Reference;
use bench_base::finding::Finding;

/// A half period whose end is less than this part of it after a tick ends at this tick: the difference is rounding.
const ROUNDING: f64 = 1e-9;

/// A square wave of zero mean. It changes by twice its amplitude; the first step has the amplitude.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SquareReference {
    /// Height to either side in metres; the first half period has its sign.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub amplitude_m: f64,
    /// Frequency in hertz, below half the servo rate. The steps are at ticks, so that half periods may differ by one tick.
    #[schemars(range(min = 1e-4, max = 50000.0))]
    pub frequency_hz: f64,
    /// Time of the first step in seconds after the loop closed.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub at_s: f64,
}

impl ReferenceDesign for SquareReference {
    fn describe(&self) -> String {
        let (height, frequency_hz) = (um(self.amplitude_m), self.frequency_hz);
        format!(
            "square wave of +-{height} at {frequency_hz} Hz from {} s",
            self.at_s
        )
    }

    fn build(&self, context: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
        Ok(Box::new(Square {
            amplitude_m: self.amplitude_m,
            half_periods_per_tick: 2.0 * self.frequency_hz * context.period_s,
            at_tick: context.ticks(self.at_s),
        }))
    }

    fn check(&self, soft_limit_m: f64, rate_hz: f64) -> Vec<Finding> {
        check_wave(self.amplitude_m, self.frequency_hz, soft_limit_m, rate_hz)
    }
}

struct Square {
    amplitude_m: f64,
    half_periods_per_tick: f64,
    at_tick: u64,
}

impl Reference for Square {
    fn at_m(&self, tick: u64) -> f64 {
        let Some(ticks) = tick.checked_sub(self.at_tick) else {
            return 0.0;
        };
        let half_periods = libm::floor(ticks as f64 * self.half_periods_per_tick + ROUNDING);
        let is_odd = libm::fmod(half_periods, 2.0) != 0.0;
        if is_odd {
            -self.amplitude_m
        } else {
            self.amplitude_m
        }
    }
}
