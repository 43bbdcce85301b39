//! A number with its unit, as typed.

use std::str::FromStr;

use super::dimension::{Dimension, UNITS};

/// Text that is not a quantity, or not of the dimension needed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct QuantityError(pub(super) String);

/// The unit that was typed after a number.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Unit {
    Bare,
    Percent,
    Of(Dimension, f64),
}

/// A number with its unit, of any dimension.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    text: String,
    number: f64,
    unit: Unit,
}

impl FromStr for Quantity {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Quantity, QuantityError> {
        let parsed = Quantity::parse(text);
        parsed.map_err(|what| QuantityError(format!("{what}; write for example 0.5, 5Hz or 3.8mm")))
    }
}

/// The longest beginning of `text` that is a finite number, and what follows it.
fn split(text: &str) -> Option<(f64, &str)> {
    let ends = (1..=text.len())
        .rev()
        .filter(|end| text.is_char_boundary(*end));
    let parsed =
        ends.filter_map(|end| Some((text[..end].parse::<f64>().ok()?, text[end..].trim())));
    parsed
        .into_iter()
        .next()
        .filter(|(number, _)| number.is_finite())
}

fn unit_of(text: &str, unit: &str) -> Result<Unit, String> {
    match unit {
        "" => return Ok(Unit::Bare),
        "%" => return Ok(Unit::Percent),
        _ => {}
    }
    // The micro sign and the Greek letter.
    let plain = unit.replace(['\u{b5}', '\u{3bc}'], "u");
    let known = UNITS.iter().find(|(symbol, ..)| *symbol == plain);
    let unknown = || format!("`{text}` has the unknown unit `{unit}`");
    known
        .map(|(_, dimension, scale)| Unit::Of(*dimension, *scale))
        .ok_or_else(unknown)
}

impl Quantity {
    /// Parses a text; the error is without a remedy.
    pub(super) fn parse(text: &str) -> Result<Quantity, String> {
        let text = text.trim();
        let not_a_quantity = || format!("`{text}` is not a number with a unit");
        let (number, unit) = split(text).ok_or_else(not_a_quantity)?;
        Ok(Quantity {
            text: text.into(),
            number,
            unit: unit_of(text, unit)?,
        })
    }

    /// As it was typed.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// The number without its unit.
    pub fn number(&self) -> f64 {
        self.number
    }

    /// Whether it was typed without a unit.
    pub fn is_bare(&self) -> bool {
        self.unit == Unit::Bare
    }

    /// The hundredth part of a percentage.
    pub fn percentage(&self) -> Option<f64> {
        (self.unit == Unit::Percent).then_some(self.number / 100.0)
    }

    /// The value in SI units of `dimension`.
    ///
    /// # Errors
    /// If the unit belongs to another dimension.
    pub fn si(&self, dimension: Dimension) -> Result<f64, QuantityError> {
        match self.unit {
            Unit::Bare => Ok(self.number),
            Unit::Percent if dimension == Dimension::Ratio => Ok(self.number / 100.0),
            Unit::Of(own, scale) if own == dimension => Ok(self.number * scale),
            Unit::Of(Dimension::Frequency, scale) if dimension == Dimension::AngularFrequency => {
                Ok(self.number * scale * std::f64::consts::TAU)
            }
            Unit::Of(own, _) => Err(self.refused(&own.description(), dimension)),
            Unit::Percent => Err(self.refused("a percentage", dimension)),
        }
    }

    fn refused(&self, is: &str, needed: Dimension) -> QuantityError {
        let (text, needed, example) = (&self.text, needed.description(), needed.example());
        QuantityError(format!(
            "`{text}` is {is}; give {needed}, such as {example}"
        ))
    }
}
