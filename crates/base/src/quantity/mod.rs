//! Quantities with units as typed: `0.1A`, `20s`, `5Hz`, `50um`, `8%`.
//!
//! A bare number is in SI units. A percentage refers to the reference of the quantity: an operating point is given in
//! percent of the beam length, a ratio in percent of 1. No other quantity has a reference, and none is given in percent;
//! tolerances of other settings (`bench model study`) are in percent of the nominal value.
//!
//! ```
//! use bench_base::quantity::{Current, Length};
//!
//! let amplitude: Current = "100mA".parse()?;
//! assert_eq!(amplitude.si(), 0.1);
//! let error = "5s".parse::<Length>().unwrap_err().to_string();
//! assert_eq!(error, "`5s` is a time in s; give a length in m, such as 50um or 3.8mm");
//! # Ok::<(), bench_base::quantity::QuantityError>(())
//! ```

mod dimension;
mod measure;
mod setting;
#[cfg(test)]
mod tests;
mod typed;

pub use dimension::Dimension;
pub use measure::{
    Acceleration, AngularFrequency, Current, Frequency, Jerk, Length, Measure, OfAcceleration,
    OfAngularFrequency, OfCurrent, OfDimension, OfFrequency, OfJerk, OfLength, OfRatio, OfSpeed,
    OfTime, Ratio, Speed, Time, si,
};
pub use setting::OperatingPoint;
pub use typed::{Quantity, QuantityError};
