//! Recordings and frequency responses as files of other programs.
//!
//! ```text
//!  recording --(ticks, streamed)--> signal (columns) --> csv, parquet, mat, uff58
//!  FRF ------------------------------------------------> csv, parquet, mat (fields of an idfrd object), uff58
//! ```
//!
//! Signals are streamed: the memory does not depend on the length of the recording. Rows (`csv`, `parquet`) are written while the
//! recording is opened. Columns (`mat`, `uff58`) need the number of ticks first, so the ticks are read again, once for all columns.

#![deny(unsafe_code)]

mod csv;
mod error;
mod file;
mod mat;
#[cfg(feature = "parquet")]
mod parquet;
mod response;
mod rows;
mod sections;
mod signal;
mod uff58;

use std::path::{Path, PathBuf};

use serde::Serialize;

pub use error::ExportError;
pub use file::Target;
pub use response::Response;
pub use signal::{Quantity, SIGNALS, Signal, Value};

use bench_recording::{Recording, RecordingError};
use file::write_new;

/// Format of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Format {
    /// Text, a line for each tick, with the unit in the name of each column
    Csv,
    /// Columns of doubles and integers, if built with `--features parquet`
    Parquet,
    /// MATLAB, level 5; with --frf a struct with the fields of an idfrd object
    Mat,
    /// Universal file format, dataset 58, in ASCII with 13 significant digits
    Uff58,
}

impl Format {
    /// The ending of the name of a file.
    pub fn ending(self) -> &'static str {
        match self {
            Format::Csv => ".csv",
            Format::Parquet => ".parquet",
            Format::Mat => ".mat",
            Format::Uff58 => ".uff",
        }
    }

    /// Refuses a format without which this program was built, before anything is computed.
    ///
    /// # Errors
    /// [`ExportError::WithoutParquet`].
    pub fn check(self) -> Result<(), ExportError> {
        match self {
            Format::Parquet if !cfg!(feature = "parquet") => Err(ExportError::WithoutParquet),
            _ => Ok(()),
        }
    }
}

/// Writes the time signals of a recording to a new file, which is complete or absent. Returns the recording and the path
/// of the file.
///
/// # Errors
/// When the recording cannot be read, the file exists or cannot be written, or the format cannot hold the recording.
pub fn write_signals(
    recording: &Path,
    format: Format,
    target: &Target,
) -> Result<(Recording, PathBuf), ExportError> {
    format.check()?;
    if !recording.exists() {
        let path = recording.to_owned();
        return Err(RecordingError::Missing { path }.into());
    }
    let (path, recording) = write_new(target, |out| match format {
        Format::Csv => csv::signals(recording, out),
        Format::Mat => mat::signals(recording, out.get_ref()),
        Format::Uff58 => uff58::signals(recording, out.get_ref()),
        #[cfg(feature = "parquet")]
        Format::Parquet => parquet::signals(recording, out),
        #[cfg(not(feature = "parquet"))]
        Format::Parquet => Err(ExportError::WithoutParquet),
    })?;
    Ok((recording, path))
}

/// Writes a frequency response to a new file, which is complete or absent. Returns the path of the file.
///
/// # Errors
/// When the file exists or cannot be written, or the program was built without the format.
pub fn write_response(
    response: &Response<'_>,
    format: Format,
    target: &Target,
) -> Result<PathBuf, ExportError> {
    format.check()?;
    let (path, ()) = write_new(target, |out| match format {
        Format::Csv => csv::response(response.frf, out),
        Format::Mat => mat::response(response, out),
        Format::Uff58 => uff58::response(response, out),
        #[cfg(feature = "parquet")]
        Format::Parquet => parquet::response(response.frf, out),
        #[cfg(not(feature = "parquet"))]
        Format::Parquet => Err(ExportError::WithoutParquet),
    })?;
    Ok(path)
}
