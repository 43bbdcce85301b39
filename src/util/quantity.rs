//! Quantities with units as typed: `0.1A`, `20s`, `5Hz`, `50um`, `8%`.
//!
//! A bare number is in SI units. A percentage refers to the reference of the quantity: an operating point is given in
//! percent of the beam length, a ratio in percent of 1. No other quantity has a reference, and none is given in percent;
//! tolerances of other settings ([`crate::model::study`]) are in percent of the nominal value.
//!
//! ```
//! use bench::util::quantity::{Current, Length};
//!
//! let amplitude: Current = "100mA".parse()?;
//! assert_eq!(amplitude.si(), 0.1);
//! let error = "5s".parse::<Length>().unwrap_err().to_string();
//! assert_eq!(error, "`5s` is a time in s; give a length in m, such as 50um or 3.8mm");
//! # Ok::<(), bench::util::quantity::QuantityError>(())
//! ```

use std::fmt;
use std::marker::PhantomData;
use std::ops::RangeInclusive;
use std::str::FromStr;

/// Dimension of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dimension {
    /// Metres.
    Length,
    /// Seconds.
    Time,
    /// Hertz.
    Frequency,
    /// Radians per second; hertz are converted.
    AngularFrequency,
    /// Amperes.
    Current,
    /// Metres per second.
    Speed,
    /// Kilograms.
    Mass,
    /// Newtons.
    Force,
    /// Newtons per metre.
    Stiffness,
    /// Radians.
    Angle,
    /// Pascals.
    Pressure,
    /// Any other dimension, whose SI unit is this text.
    Other(&'static str),
    /// A ratio or a count: no unit, or percent.
    Ratio,
}

/// Units that can be typed, each with its value in SI units. The first of a dimension is its SI unit.
const UNITS: &[(&str, Dimension, f64)] = &[
    ("m", Dimension::Length, 1.0),
    ("mm", Dimension::Length, 1e-3),
    ("um", Dimension::Length, 1e-6),
    ("nm", Dimension::Length, 1e-9),
    ("s", Dimension::Time, 1.0),
    ("ms", Dimension::Time, 1e-3),
    ("us", Dimension::Time, 1e-6),
    ("Hz", Dimension::Frequency, 1.0),
    ("kHz", Dimension::Frequency, 1e3),
    ("mHz", Dimension::Frequency, 1e-3),
    ("rad/s", Dimension::AngularFrequency, 1.0),
    ("A", Dimension::Current, 1.0),
    ("mA", Dimension::Current, 1e-3),
    ("uA", Dimension::Current, 1e-6),
    ("m/s", Dimension::Speed, 1.0),
    ("mm/s", Dimension::Speed, 1e-3),
    ("um/s", Dimension::Speed, 1e-6),
    ("kg", Dimension::Mass, 1.0),
    ("g", Dimension::Mass, 1e-3),
    ("N", Dimension::Force, 1.0),
    ("mN", Dimension::Force, 1e-3),
    ("N/m", Dimension::Stiffness, 1.0),
    ("kN/m", Dimension::Stiffness, 1e3),
    ("N/mm", Dimension::Stiffness, 1e3),
    ("rad", Dimension::Angle, 1.0),
    ("mrad", Dimension::Angle, 1e-3),
    ("Pa", Dimension::Pressure, 1.0),
    ("MPa", Dimension::Pressure, 1e6),
    ("GPa", Dimension::Pressure, 1e9),
];

/// Suffixes of the keys of settings, with the dimension of their values. The first match counts.
const KEY_SUFFIXES: &[(&str, Dimension)] = &[
    ("_n_per_m", Dimension::Stiffness),
    ("_n_per_a", Dimension::Other("N/A")),
    ("_a_per_um", Dimension::Other("A/um")),
    ("_n_s_per_m", Dimension::Other("N s/m")),
    ("_m_per_s2", Dimension::Other("m/s^2")),
    ("_m_per_s", Dimension::Speed),
    ("_a_per_s", Dimension::Other("A/s")),
    ("_rad_s", Dimension::AngularFrequency),
    ("_per_kg", Dimension::Other("1/kg")),
    ("_per_s", Dimension::Other("1/s")),
    ("_days", Dimension::Other("days")),
    ("_rad", Dimension::Angle),
    ("_hz", Dimension::Frequency),
    ("_kg", Dimension::Mass),
    ("_pa", Dimension::Pressure),
    ("_a", Dimension::Current),
    ("_m", Dimension::Length),
    ("_n", Dimension::Force),
    ("_s", Dimension::Time),
];

impl Dimension {
    /// The dimension of a setting, by the suffix of its key: `chirp.stop_hz` is a frequency. A key without a suffix has
    /// no unit.
    pub fn of_key(key: &str) -> Dimension {
        let suffix = KEY_SUFFIXES
            .iter()
            .find(|(suffix, _)| key.ends_with(suffix));
        suffix.map_or(Dimension::Ratio, |(_, dimension)| *dimension)
    }

    /// The SI unit; empty for a ratio.
    pub fn si_unit(self) -> &'static str {
        match self {
            Dimension::Ratio => "",
            Dimension::Other(unit) => unit,
            _ => self.units().next().map_or("", |(unit, _)| unit),
        }
    }

    /// A value in SI units with its unit: `8 m`.
    pub fn display(self, si: f64) -> String {
        format!("{si} {}", self.si_unit()).trim_end().to_string()
    }

    /// Suggestions for a number without a unit that is out of range: the units with which it would be in range, as
    /// `8mm` for 8 where 0.5 m is the largest value.
    pub fn other_readings(self, number: f64, allowed: &RangeInclusive<f64>) -> Vec<String> {
        let units = self.units().filter(|(_, scale)| *scale != 1.0);
        let readings = units.filter(|(_, scale)| allowed.contains(&(number * scale)));
        readings
            .map(|(unit, _)| format!("{number}{unit}"))
            .collect()
    }

    fn units(self) -> impl Iterator<Item = (&'static str, f64)> {
        let own = UNITS
            .iter()
            .filter(move |(_, dimension, _)| *dimension == self);
        own.map(|(unit, _, scale)| (*unit, *scale))
    }

    pub(crate) fn description(self) -> String {
        let name = match self {
            Dimension::Length => "a length",
            Dimension::Time => "a time",
            Dimension::Frequency => "a frequency",
            Dimension::AngularFrequency => "an angular frequency",
            Dimension::Current => "a current",
            Dimension::Speed => "a speed",
            Dimension::Mass => "a mass",
            Dimension::Force => "a force",
            Dimension::Stiffness => "a stiffness",
            Dimension::Angle => "an angle",
            Dimension::Pressure => "a pressure",
            Dimension::Other(unit) => return format!("a number in {unit}"),
            Dimension::Ratio => return "a number without unit".into(),
        };
        format!("{name} in {}", self.si_unit())
    }

    fn example(self) -> &'static str {
        match self {
            Dimension::Length => "50um or 3.8mm",
            Dimension::Time => "20s or 10ms",
            Dimension::Frequency => "5Hz or 2kHz",
            Dimension::AngularFrequency => "180rad/s or 29Hz",
            Dimension::Current => "0.1A or 100mA",
            Dimension::Speed => "0.1mm/s or 1e-4",
            Dimension::Mass => "60g or 0.06kg",
            Dimension::Force => "26N or 500mN",
            Dimension::Stiffness => "36000N/m or 36kN/m",
            Dimension::Angle => "0.02rad or 20mrad",
            Dimension::Pressure => "69GPa or 6.9e10",
            Dimension::Other(_) => "0.5",
            Dimension::Ratio => "10% or 0.1",
        }
    }
}

/// Text that is not a quantity, or not of the dimension needed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct QuantityError(String);

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
    fn parse(text: &str) -> Result<Quantity, String> {
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

/// The dimension of a [`Measure`].
pub trait OfDimension {
    /// The dimension.
    const DIMENSION: Dimension;
}

/// A quantity of one dimension, with its text.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure<D> {
    si: f64,
    quantity: Quantity,
    dimension: PhantomData<D>,
}

impl<D> Measure<D> {
    /// The value in SI units.
    pub fn si(&self) -> f64 {
        self.si
    }

    /// As it was typed.
    pub fn text(&self) -> &str {
        self.quantity.text()
    }
}

impl<D> fmt::Display for Measure<D> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.text())
    }
}

impl<D: OfDimension> FromStr for Measure<D> {
    type Err = QuantityError;

    fn from_str(text: &str) -> Result<Self, QuantityError> {
        let with_example = |what: String| {
            let (needed, example) = (D::DIMENSION.description(), D::DIMENSION.example());
            QuantityError(format!("{what}; give {needed}, such as {example}"))
        };
        let quantity = Quantity::parse(text).map_err(with_example)?;
        Ok(Measure {
            si: quantity.si(D::DIMENSION)?,
            quantity,
            dimension: PhantomData,
        })
    }
}

/// A parser of the value in SI units, for options that need no more: `si::<OfTime>`.
///
/// # Errors
/// If the text is not a quantity of the dimension.
pub fn si<D: OfDimension>(text: &str) -> Result<f64, QuantityError> {
    Ok(text.parse::<Measure<D>>()?.si())
}

macro_rules! measures {
    ($($(#[$doc:meta])* $name:ident = $marker:ident, $dimension:expr;)*) => {$(
        /// The dimension of the type of the same name.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct $marker;

        impl OfDimension for $marker {
            const DIMENSION: Dimension = $dimension;
        }

        $(#[$doc])*
        pub type $name = Measure<$marker>;
    )*};
}

measures! {
    /// A length in metres: `50um`.
    Length = OfLength, Dimension::Length;
    /// A time in seconds: `20s`.
    Time = OfTime, Dimension::Time;
    /// A frequency in hertz: `5Hz`.
    Frequency = OfFrequency, Dimension::Frequency;
    /// An angular frequency in radians per second: `180rad/s`, or `29Hz`.
    AngularFrequency = OfAngularFrequency, Dimension::AngularFrequency;
    /// A current in amperes: `0.1A`.
    Current = OfCurrent, Dimension::Current;
    /// A speed in metres per second: `0.1mm/s`.
    Speed = OfSpeed, Dimension::Speed;
    /// A ratio: `10%` or `0.1`.
    Ratio = OfRatio, Dimension::Ratio;
}

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
        let text = &self.text;
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

#[cfg(test)]
mod tests {
    use super::*;

    fn si(text: &str, dimension: Dimension) -> Result<f64, String> {
        let quantity: Quantity = text.parse().map_err(|e: QuantityError| e.to_string())?;
        quantity.si(dimension).map_err(|e| e.to_string())
    }

    #[test]
    fn converts_units_to_si_and_takes_bare_numbers_as_si() {
        for (text, dimension, expected) in [
            ("0.1A", Dimension::Current, 0.1),
            ("100mA", Dimension::Current, 100.0 * 1e-3),
            ("20 s", Dimension::Time, 20.0),
            ("10ms", Dimension::Time, 10.0 * 1e-3),
            ("2kHz", Dimension::Frequency, 2000.0),
            (" 50um", Dimension::Length, 50.0 * 1e-6),
            ("50\u{b5}m", Dimension::Length, 50.0 * 1e-6),
            ("50\u{3bc}m", Dimension::Length, 50.0 * 1e-6),
            ("-5e-5m", Dimension::Length, -5e-5),
            ("0.95", Dimension::Length, 0.95),
            ("8 %", Dimension::Ratio, 0.08),
            ("1Hz", Dimension::AngularFrequency, std::f64::consts::TAU),
        ] {
            assert_eq!(si(text, dimension), Ok(expected), "{text}");
        }
    }

    #[test]
    fn rejects_text_without_number_and_numbers_that_are_not_finite() {
        for text in ["", "mm", "A5", "NaN", "inf%", "-infm", "1e999", "--5s"] {
            let error = si(text, Dimension::Length).unwrap_err();
            assert!(error.contains(&format!("`{text}`")), "{error}");
        }
    }

    #[test]
    fn rejects_unknown_units_and_units_of_another_dimension() {
        let error = si("8 apples", Dimension::Length).unwrap_err();
        assert_eq!(
            error,
            "`8 apples` has the unknown unit `apples`; write for example 0.5, 5Hz or 3.8mm"
        );
        let error = "8%".parse::<Length>().unwrap_err().to_string();
        assert!(
            error.contains("a percentage; give a length in m"),
            "{error}"
        );
        let error = "8mm".parse::<Ratio>().unwrap_err().to_string();
        assert!(
            error.contains("a length in m; give a number without unit"),
            "{error}"
        );
    }

    #[test]
    fn reads_the_dimension_of_a_setting_from_its_key() {
        for (key, dimension) in [
            ("plant.operating_point_m", Dimension::Length),
            ("plant.springs.k.stiffness_n_per_m", Dimension::Stiffness),
            ("amplifier.slew_limit_a_per_s", Dimension::Other("A/s")),
            ("control.reference.speed_m_per_s", Dimension::Speed),
            (
                "plant.damping.first.omega_rad_s",
                Dimension::AngularFrequency,
            ),
            ("chirp.stop_hz", Dimension::Frequency),
            ("plant.mass_asymmetry", Dimension::Ratio),
        ] {
            assert_eq!(Dimension::of_key(key), dimension, "{key}");
        }
    }

    #[test]
    fn percent_of_an_operating_point_is_of_the_beam_length() {
        let share: Quantity = "8%".parse().unwrap();
        assert_eq!(
            share.for_setting("plant.operating_point_m", Some(0.05)),
            Ok(0.004)
        );
        assert_eq!(
            share.for_setting("plant.mass_asymmetry", Some(0.05)),
            Ok(0.08)
        );
        assert!(share.for_setting("plant.operating_point_m", None).is_err());
        assert!(
            share
                .for_setting("interlock.soft_limit_m", Some(0.05))
                .is_err()
        );
    }

    #[test]
    fn an_operating_point_without_unit_is_refused_with_both_ways_to_write_it() {
        let ratio = |text| OperatingPoint::with_unit(text)?.ratio(0.05);
        for (text, expected) in [("8%", 0.08), ("0", 0.0), ("0%", 0.0), ("4mm", 0.004 / 0.05)] {
            assert_eq!(ratio(text), Ok(expected), "{text}");
        }
        // 0.07 * 100 is 7.000000000000001.
        for (text, percent, metres) in [("0.07", "7%", "0.07m"), ("-0.15", "-15%", "-0.15m")] {
            let error = ratio(text).unwrap_err().to_string();
            let words = format!(
                "`{text}` has no unit; write {percent} for a ratio of {text} of the beam length, or {metres} for metres"
            );
            assert_eq!(error, words);
        }
        let error = ratio("5s").unwrap_err().to_string();
        assert!(error.contains("a time in s; give a length in m"), "{error}");
    }

    #[test]
    fn offers_the_units_with_which_a_bare_number_is_allowed() {
        assert_eq!(
            Dimension::Length.other_readings(8.0, &(-0.5..=0.5)),
            ["8mm", "8um", "8nm"]
        );
        assert_eq!(Dimension::Time.other_readings(1e9, &(0.0..=1.0)), [""; 0]);
    }
}
