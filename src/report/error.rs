//! Why there is no plot.

use thiserror::Error;

/// What keeps a plot from being drawn.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ReportError {
    /// There is nothing to draw.
    #[error("a plot without a trace: give at least one")]
    NoTrace,
    /// A trace without points.
    #[error("the trace {name:?} has no point: leave it out")]
    Empty {
        /// Name of the trace.
        name: String,
    },
    /// Columns of different lengths.
    #[error("the trace {name:?} has {frequencies} frequencies, but a column of {values} values")]
    Lengths {
        /// Name of the trace.
        name: String,
        /// Number of frequencies.
        frequencies: usize,
        /// Number of values.
        values: usize,
    },
    /// A frequency that a logarithmic axis cannot show, or that does not rise.
    #[error(
        "the trace {name:?} has the frequency {value} Hz at index {index}: they must be finite, above 0 Hz and rise"
    )]
    Frequency {
        /// Name of the trace.
        name: String,
        /// Index of the frequency.
        index: usize,
        /// Its value.
        value: f64,
    },
    /// A value that is not a number.
    #[error(
        "the trace {name:?} has a value that is not finite at {frequency_hz} Hz: leave that frequency out"
    )]
    NotFinite {
        /// Name of the trace.
        name: String,
        /// Where.
        frequency_hz: f64,
    },
    /// No magnitude that a logarithmic axis can show.
    #[error("no trace has a magnitude above 0: there is no response to draw")]
    NoMagnitude,
    /// The drawing library failed.
    #[error("drawing failed: {0}")]
    Drawing(String),
}
