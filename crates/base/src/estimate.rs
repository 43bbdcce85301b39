//! A number with its standard deviation.

use serde::ser::{Serialize, SerializeStruct, Serializer};

/// Standard deviations to either side of the mean that contain 95 % of a normal distribution.
pub const SIGMAS_95: f64 = 1.959_963_984_540_054;

/// A number with its standard deviation. In JSON: `value`, and the limits `low` and `high` of its 95 % confidence interval.
///
/// ```
/// use bench_base::estimate::Estimate;
///
/// let frequency_hz = Estimate { value: 29.27, sigma: 0.01 };
/// assert!((frequency_hz.half_width_95() - 0.0196).abs() < 1e-6);
/// assert!((frequency_hz.scaled(std::f64::consts::TAU).value - 183.91).abs() < 0.01);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard deviation, in the same unit.
    pub sigma: f64,
}

impl Estimate {
    /// The estimate in another unit.
    pub fn scaled(self, factor: f64) -> Estimate {
        Estimate {
            value: self.value * factor,
            sigma: self.sigma * factor.abs(),
        }
    }

    /// Half the width of the 95 % confidence interval.
    pub fn half_width_95(self) -> f64 {
        SIGMAS_95 * self.sigma
    }

    /// The limits of the 95 % confidence interval.
    pub fn interval_95(self) -> (f64, f64) {
        let half = self.half_width_95();
        (self.value - half, self.value + half)
    }

    /// Probability that a normally distributed number with this mean and deviation is below zero.
    pub fn below_zero_probability(self) -> f64 {
        0.5 * libm::erfc(self.value / (self.sigma * std::f64::consts::SQRT_2))
    }
}

impl Serialize for Estimate {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let (low, high) = self.interval_95();
        let mut estimate = serializer.serialize_struct("Estimate", 3)?;
        estimate.serialize_field("value", &self.value)?;
        estimate.serialize_field("low", &low)?;
        estimate.serialize_field("high", &high)?;
        estimate.end()
    }
}
