//! Errors of the estimators.

use thiserror::Error;

/// Why no frequency response can be estimated. Messages state value, place, limit and remedy.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum IdentifyError {
    /// Samples, their number or their rate are unusable.
    #[error("{0}")]
    Signals(String),
    /// The band is invalid, or no frequency of the record lies in it.
    #[error("{0}")]
    Band(String),
    /// Too few whole periods to average.
    #[error("{0}")]
    Periods(String),
    /// The input has no energy in the band.
    #[error(
        "the input has no energy between {low_hz} and {high_hz} Hz to distinguish \
         the response from noise; excite this band, or select the band that was excited"
    )]
    NotExcited {
        /// Lower limit of the band.
        low_hz: f64,
        /// Upper limit of the band.
        high_hz: f64,
    },
    /// A setting of an estimator is out of bounds.
    #[error("{name} is {value}; give a value from {min} to {max}")]
    Setting {
        /// Name of the setting.
        name: &'static str,
        /// Its value.
        value: f64,
        /// Smallest allowed value.
        min: f64,
        /// Largest allowed value.
        max: f64,
    },
}

impl IdentifyError {
    /// The input has no energy in `band_hz`.
    pub(super) fn not_excited((low_hz, high_hz): (f64, f64)) -> Self {
        Self::NotExcited { low_hz, high_hz }
    }
}

/// Checks that a setting lies within its bounds, limits included; NaN does not.
pub(super) fn check_setting(
    name: &'static str,
    value: f64,
    min: f64,
    max: f64,
) -> Result<(), IdentifyError> {
    if value >= min && value <= max {
        Ok(())
    } else {
        Err(IdentifyError::Setting {
            name,
            value,
            min,
            max,
        })
    }
}
