//! Quantities of one dimension.

use std::borrow::Cow;
use std::fmt;
use std::marker::PhantomData;
use std::str::FromStr;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Serialize, Serializer};

use super::dimension::Dimension;
use super::typed::{Quantity, QuantityError};

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

/// As it was typed.
impl<D> Serialize for Measure<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.text())
    }
}

impl<D: OfDimension> JsonSchema for Measure<D> {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> Cow<'static, str> {
        D::DIMENSION.description().into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let examples: Vec<&str> = D::DIMENSION.example().split(" or ").collect();
        json_schema!({ "type": "string", "examples": examples })
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
    /// An acceleration in metres per second squared: `50mm/s^2`.
    Acceleration = OfAcceleration, Dimension::Acceleration;
    /// A jerk in metres per second cubed: `5m/s^3`.
    Jerk = OfJerk, Dimension::Jerk;
    /// A ratio: `10%` or `0.1`.
    Ratio = OfRatio, Dimension::Ratio;
}
