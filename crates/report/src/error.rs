//! Errors of plots.

use thiserror::Error;

/// Why a plot cannot be drawn.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ReportError {
    /// No trace or chart was given.
    #[error("there is nothing to plot; give at least one trace")]
    NoTrace,
    /// A trace without points.
    #[error("trace {name:?} has no points; leave it out")]
    Empty {
        /// Name of the trace.
        name: String,
    },
    /// Columns of different lengths.
    #[error(
        "trace {name:?} has {frequencies} frequencies, but a column of {values} values; give each column one value per frequency"
    )]
    Lengths {
        /// Name of the trace.
        name: String,
        /// Number of frequencies.
        frequencies: usize,
        /// Number of values.
        values: usize,
    },
    /// A frequency that is not positive or not rising.
    #[error(
        "trace {name:?} has the frequency {value} Hz at index {index}; give finite frequencies above 0 Hz in rising order"
    )]
    Frequency {
        /// Name of the trace.
        name: String,
        /// Index of the frequency.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A value that is not finite.
    #[error(
        "trace {name:?} has a value that is not finite at {frequency_hz} Hz; leave that frequency out"
    )]
    NotFinite {
        /// Name of the trace.
        name: String,
        /// Its frequency in hertz.
        frequency_hz: f64,
    },
    /// No magnitude is above 0.
    #[error(
        "no trace has a magnitude above 0, which a logarithmic axis needs; check the data of the traces"
    )]
    NoMagnitude,
}
