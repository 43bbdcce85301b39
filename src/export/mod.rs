//! Recordings and frequency responses as files of other programs.
//!
//! ```text
//!  recording --(ticks, streamed)--> signal (columns) --> csv, parquet, mat, uff58
//!  FRF ------------------------------------------------> mat (fields of an idfrd object), uff58
//! ```
//!
//! Signals are streamed: the memory does not depend on the length of the recording.

mod csv;
mod error;
mod file;
pub mod frf;
mod mat;
#[cfg(feature = "parquet")]
mod parquet;
mod signal;
mod uff58;

use std::path::Path;

pub use error::ExportError;
pub use signal::{Quantity, SIGNALS, Sample, Signal};

use crate::recording::Recording;

/// Format of the time signals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalFormat {
    /// A line for each tick.
    Csv,
    /// A row for each tick; only in a program with the feature `parquet`.
    Parquet,
    /// MATLAB, level 5, not compressed: a variable for each signal.
    Mat,
    /// Universal file format, dataset 58 in ASCII: a dataset for each signal.
    Uff58,
}

/// Writes the time signals of a recording to a file, which is complete or absent.
///
/// # Errors
/// When the recording cannot be read, the file cannot be written, or the format cannot hold the recording.
pub fn write_signals(
    recording: &Recording,
    format: SignalFormat,
    path: &Path,
) -> Result<(), ExportError> {
    match format {
        SignalFormat::Csv => file::replace(path, |out| csv::write(recording, out)),
        SignalFormat::Mat => file::replace(path, |out| mat::signals(recording, out)),
        SignalFormat::Uff58 => file::replace(path, |out| uff58::signals(recording, out)),
        #[cfg(feature = "parquet")]
        SignalFormat::Parquet => file::replace(path, |out| parquet::write(recording, out)),
        #[cfg(not(feature = "parquet"))]
        SignalFormat::Parquet => Err(ExportError::WithoutParquet),
    }
}
