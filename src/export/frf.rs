//! Files of a measured frequency response from current (A) to displacement (m).

use std::path::Path;

use super::{ExportError, file, mat, uff58};
use crate::identify::Frf;

/// Format of a frequency response.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrfFormat {
    /// MATLAB, level 5: a struct with the fields of an `idfrd` object.
    Mat,
    /// Universal file format, dataset 58 in ASCII.
    Uff58,
}

/// Writes a frequency response to a file, which is complete or absent. `source` is the name of the file it comes from.
///
/// # Errors
/// When the file cannot be written.
pub fn write(frf: &Frf, source: &str, format: FrfFormat, path: &Path) -> Result<(), ExportError> {
    file::replace(path, |out| match format {
        FrfFormat::Mat => mat::response(frf, out),
        FrfFormat::Uff58 => uff58::response(frf, source, out),
    })
}
