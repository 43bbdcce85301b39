//! A grid as it is typed: FROM:TO:COUNT.

use std::borrow::Cow;
use std::fmt::Display;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};

use bench_base::quantity::{OperatingPoint, QuantityError, Ratio};
use bench_experiment::ExperimentError;

/// Largest number of values of a grid.
const MOST: usize = 10_000;

/// At least two values at equal distances, with both ends.
#[derive(Clone, Debug, PartialEq)]
pub struct ValueRange<T> {
    from: T,
    to: T,
    count: usize,
}

/// As it was typed, with the units.
impl<T: Display> Serialize for ValueRange<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let ValueRange { from, to, count } = self;
        serializer.collect_str(&format_args!("{from}:{to}:{count}"))
    }
}

impl<T> JsonSchema for ValueRange<T> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "ValueRange".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "examples": ["-10%:10%:10"] })
    }
}

/// A range of operating points, each with its unit. For clap.
///
/// # Errors
/// When the text is no such range.
pub fn operating_points(text: &str) -> Result<ValueRange<OperatingPoint>, String> {
    ValueRange::parse(text, "0%:8%:15 or 0mm:3.8mm:15", OperatingPoint::with_unit)
}

/// A range of mass asymmetries. For clap.
///
/// # Errors
/// When the text is no such range.
pub fn asymmetries(text: &str) -> Result<ValueRange<Ratio>, String> {
    ValueRange::parse(text, "-10%:10%:41", str::parse)
}

impl<T> ValueRange<T> {
    fn parse(
        text: &str,
        example: &str,
        value: impl Fn(&str) -> Result<T, QuantityError>,
    ) -> Result<ValueRange<T>, String> {
        let [from, to, count] = text.split(':').collect::<Vec<_>>()[..] else {
            return Err(format!("not a range; write FROM:TO:COUNT, as in {example}"));
        };
        let value = |text| value(text).map_err(|error| error.to_string());
        Ok(ValueRange {
            from: value(from)?,
            to: value(to)?,
            count: count_of(count)?,
        })
    }
}

impl ValueRange<OperatingPoint> {
    /// The values of `--operating-points` as ratios of the beam length.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn ratios(&self, beam_length_m: f64) -> Result<Vec<f64>, ExperimentError> {
        let ratio = |point: &OperatingPoint| {
            let ratio = point.ratio(beam_length_m);
            ratio.map_err(|error| ExperimentError::Refused(error.to_string()))
        };
        self.spaced("--operating-points", ratio(&self.from)?, ratio(&self.to)?)
    }
}

impl ValueRange<Ratio> {
    /// The values of `--asymmetries`.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn ratios(&self) -> Result<Vec<f64>, ExperimentError> {
        self.spaced("--asymmetries", self.from.si(), self.to.si())
    }
}

impl<T: Display> ValueRange<T> {
    fn spaced(&self, option: &str, from: f64, to: f64) -> Result<Vec<f64>, ExperimentError> {
        if from == to {
            return Err(ExperimentError::Refused(format!(
                "{option}: FROM ({}) and TO ({}) are equal; give two different values",
                self.from, self.to
            )));
        }
        let last = (self.count - 1) as f64;
        let inner = (0..self.count - 1).map(|k| from + (to - from) * k as f64 / last);
        Ok(inner.chain([to]).collect())
    }
}

fn count_of(text: &str) -> Result<usize, String> {
    let count = text.trim().parse().ok();
    let count = count.filter(|count| (2..=MOST).contains(count));
    count.ok_or_else(|| format!("COUNT `{text}` is invalid; give a whole number from 2 to {MOST}"))
}
