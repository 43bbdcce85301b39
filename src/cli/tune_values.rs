//! Values of the options of `bench tune`.

use std::ops::RangeInclusive;
use std::str::FromStr;

use clap::ValueEnum;

use bench_base::quantity::AngularFrequency;
use bench_control::tuning::{Goal, SensitivityLimit};

/// The goal as typed.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum GoalName {
    /// Largest slope bandwidth.
    Disturbance,
    /// Largest sensitivity bandwidth.
    Bandwidth,
    /// Smallest standard deviation of the error.
    Rms,
}

impl From<GoalName> for Goal {
    fn from(name: GoalName) -> Goal {
        match name {
            GoalName::Disturbance => Goal::Disturbance,
            GoalName::Bandwidth => Goal::Bandwidth,
            GoalName::Rms => Goal::Rms,
        }
    }
}

/// A finite number.
fn number(text: &str) -> Result<f64, String> {
    let number = f64::from_str(text).ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("`{text}` is not a number; give one, such as 0.5"))
}

/// A number in a range; otherwise a message with the range and a hint.
fn within(text: &str, range: RangeInclusive<f64>, hint: &str) -> Result<f64, String> {
    let value = number(text)?;
    let (low, high) = (range.start(), range.end());
    if range.contains(&value) {
        Ok(value)
    } else {
        Err(format!("{value} is not between {low} and {high}; {hint}"))
    }
}

/// A modulus margin. For clap.
pub(super) fn margin(text: &str) -> Result<f64, String> {
    within(text, 0.05..=0.95, "a usual value is 0.5")
}

/// A gain margin. For clap.
pub(super) fn gain_margin(text: &str) -> Result<f64, String> {
    within(text, 1.01..=100.0, "a usual value is 2")
}

/// A phase margin in degrees. For clap.
pub(super) fn phase_margin_deg(text: &str) -> Result<f64, String> {
    within(text, 1.0..=80.0, "a usual value is 40")
}

/// A factor of the damping ratios. For clap.
pub(super) fn factor(text: &str) -> Result<f64, String> {
    within(text, 0.01..=1.0, "1 leaves the damping unchanged")
}

/// A limit above 0. For clap.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    let value = number(text)?;
    if value > 0.0 {
        Ok(value)
    } else {
        Err(format!("{value} is not positive; give a limit above 0"))
    }
}

/// A limit such as `0.141@10rad/s`. For clap.
pub(super) fn sensitivity_limit(text: &str) -> Result<SensitivityLimit, String> {
    let form = "give a ratio and a frequency, as in 0.141@10rad/s";
    let (magnitude, frequency) = text
        .split_once('@')
        .ok_or_else(|| format!("`{text}` has no @; {form}"))?;
    let frequency: AngularFrequency = frequency.parse().map_err(|e| format!("{e}; {form}"))?;
    let omega_rad_s = frequency.si();
    if omega_rad_s > 0.0 {
        Ok(SensitivityLimit {
            magnitude: positive(magnitude)?,
            omega_rad_s,
        })
    } else {
        Err(format!("`{text}`: the frequency is not positive; {form}"))
    }
}
