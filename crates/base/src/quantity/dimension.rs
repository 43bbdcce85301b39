//! Dimensions and their units.

use std::ops::RangeInclusive;

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
    /// Metres per second squared.
    Acceleration,
    /// Metres per second cubed.
    Jerk,
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
pub(super) const UNITS: &[(&str, Dimension, f64)] = &[
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
    ("m/s^2", Dimension::Acceleration, 1.0),
    ("mm/s^2", Dimension::Acceleration, 1e-3),
    ("m/s^3", Dimension::Jerk, 1.0),
    ("mm/s^3", Dimension::Jerk, 1e-3),
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
    ("_m_per_s3", Dimension::Jerk),
    ("_m_per_s2", Dimension::Acceleration),
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
        format!("{} {}", number_text(si), self.si_unit())
            .trim_end()
            .to_string()
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

    /// The dimension in words, with the units in which it can be given.
    pub fn description(self) -> String {
        let name = match self {
            Dimension::Length => "a length",
            Dimension::Time => "a time",
            Dimension::Frequency => "a frequency",
            Dimension::AngularFrequency => "an angular frequency",
            Dimension::Current => "a current",
            Dimension::Speed => "a speed",
            Dimension::Acceleration => "an acceleration",
            Dimension::Jerk => "a jerk",
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

    pub(super) fn example(self) -> &'static str {
        match self {
            Dimension::Length => "50um or 3.8mm",
            Dimension::Time => "20s or 10ms",
            Dimension::Frequency => "5Hz or 2kHz",
            Dimension::AngularFrequency => "180rad/s or 29Hz",
            Dimension::Current => "0.1A or 100mA",
            Dimension::Speed => "0.1mm/s or 1e-4",
            Dimension::Acceleration => "50mm/s^2 or 0.05",
            Dimension::Jerk => "5m/s^3 or 5",
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

/// A number, with an exponent if it has many zeros: `1e308`.
fn number_text(number: f64) -> String {
    let is_short = number == 0.0 || (1e-12..1e12).contains(&number.abs());
    if is_short {
        number.to_string()
    } else {
        format!("{number:e}")
    }
}
