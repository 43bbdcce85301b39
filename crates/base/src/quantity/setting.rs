//! Quantities as values of settings, and the operating point.

use std::borrow::Cow;
use std::fmt;
use std::str::FromStr;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};

use super::dimension::Dimension;
use super::typed::{Quantity, QuantityError};

impl Quantity {
    /// The setting whose percentages are of the beam length.
    pub const OPERATING_POINT: &str = "plant.operating_point_m";

    /// The value of a setting in SI units, by the suffix of its key. An operating point may be in percent of the beam
    /// length, if the plant has beams.
    ///
    /// # Errors
    /// If the unit does not belong to the setting.
    pub fn for_setting(&self, key: &str, beam_length_m: Option<f64>) -> Result<f64, QuantityError> {
        if key == Quantity::OPERATING_POINT {
            return self.operating_point_m(beam_length_m);
        }
        let needed = |error: QuantityError| QuantityError(format!("{error}, for `{key}`"));
        self.si(Dimension::of_key(key)).map_err(needed)
    }

    /// An operating point in metres; a percentage is of the beam length.
    ///
    /// # Errors
    /// If it is not a length, or a percentage where the plant has no beams.
    pub fn operating_point_m(&self, beam_length_m: Option<f64>) -> Result<f64, QuantityError> {
        let Some(share) = self.percentage() else {
            return self.si(Dimension::Length);
        };
        let text = self.text();
        let no_beams = || {
            QuantityError(format!(
                "`{text}` is a percentage of the beam length, and this plant has no beams; give a length, such as 3.8mm"
            ))
        };
        beam_length_m
            .map(|length_m| share * length_m)
            .ok_or_else(no_beams)
    }
}

/// An operating point as typed: a length, or a percentage of the beam length.
#[derive(Clone, Debug, PartialEq)]
pub struct OperatingPoint(Quantity);

impl OperatingPoint {
    /// An operating point whose unit must be typed, for options of which a bare number once was a ratio of the beam length.
    /// Only 0 needs no unit.
    ///
    /// # Errors
    /// If the text is not an operating point, or has no unit.
    pub fn with_unit(text: &str) -> Result<OperatingPoint, QuantityError> {
        let point: OperatingPoint = text.parse()?;
        let (text, number) = (point.0.text(), point.0.number());
        if !point.0.is_bare() || number == 0.0 {
            return Ok(point);
        }
        // Without the rounding error of the multiplication.
        let percent = (number * 1e12).round() / 1e10;
        Err(QuantityError(format!(
            "`{text}` has no unit; write {percent}% for a ratio of {text} of the beam length, or {text}m for metres"
        )))
    }

    /// As a ratio of this beam length.
    ///
    /// # Errors
    /// If its unit is not that of a length.
    pub fn ratio(&self, beam_length_m: f64) -> Result<f64, QuantityError> {
        match self.0.percentage() {
            Some(share) => Ok(share),
            None => Ok(self.metres(None)? / beam_length_m),
        }
    }

    /// The operating point in metres, on a plant with beams of this length.
    ///
    /// # Errors
    /// If it is a percentage and the plant has no beams.
    pub fn metres(&self, beam_length_m: Option<f64>) -> Result<f64, QuantityError> {
        self.0.operating_point_m(beam_length_m)
    }
}

impl FromStr for OperatingPoint {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        let needed = |what: String| {
            QuantityError(format!(
                "{what}; write 8% of the beam length, 3.8mm, or metres"
            ))
        };
        let point = OperatingPoint(Quantity::parse(text).map_err(needed)?);
        // Any beam length shows whether the unit is one of a length.
        point.metres(Some(1.0)).map(|_| point)
    }
}

impl fmt::Display for OperatingPoint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0.text())
    }
}

/// As it was typed.
impl Serialize for OperatingPoint {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl JsonSchema for OperatingPoint {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        "OperatingPoint".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({ "type": "string", "examples": ["3.8mm", "8%"] })
    }
}
