//! Controllers in files of other programs: MAT-files of level 5 (MATLAB, scipy), archives of numpy, JSON.
//!
//! A file has the arrays num, den, Ts of a ratio of polynomials, or z, p, k, Ts, or A, B, C, D, Ts, or those of scipy.signal, at its
//! top level or in a structure. The result is a controller file with the table `[tf]`, `[zpk]` or `[ss]` and the numbers as they were
//! saved, unless another field of the file (a delay, a unit of time, E) changes the response.
//!
//! ```text
//!  bytes --mat, npz, json--> variables --select--> form, domain, properties --convert--> TransferSettings --> controller file
//! ```

mod bytes;
mod convert;
mod form;
mod json;
mod mat;
mod names;
mod npy;
mod npz;
mod parts;
mod period;
mod properties;
mod remarks;
mod select;
mod value;

use std::path::Path;

use super::error::ControllerError;
use super::file::ControllerText;
use super::import_error::{FormatError, ImportError};
use super::transfer::{Cascade, TransferError, TransferSettings};
use bench_base::input_file::{self, MAX_SETTINGS_BYTES};

pub use select::ImportOptions;
pub use value::{NumericArray, Value, Variables};

/// A controller of another program.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// The transfer function as it was saved.
    pub settings: TransferSettings,
    /// Its sections.
    pub cascade: Cascade,
    /// The controller file (TOML).
    pub text: String,
    /// Fields that changed the numbers, and poles that deserve attention.
    pub remarks: Vec<String>,
}

/// Servo rate at which a continuous controller is checked: its sections are stable and proper at any rate.
const ANY_RATE_HZ: f64 = 5000.0;

/// Reads a controller from a file of another program, converts it to sections, and checks that both have the same response.
///
/// # Errors
/// The file cannot be read, has no controller or several, or the controller is refused (see [`Cascade::of`]).
pub fn import(
    path: &Path,
    title: &str,
    options: &ImportOptions,
) -> Result<Imported, ControllerError> {
    let bytes = input_file::read(path, MAX_SETTINGS_BYTES);
    let bytes = bytes.map_err(|e| ImportError::Unreadable {
        path: path.into(),
        why: e.to_string(),
    })?;
    let variables = read_variables(&bytes).map_err(|why| ImportError::Format {
        path: path.into(),
        why,
    })?;
    let content = |why| ImportError::Content {
        path: path.into(),
        why,
    };
    let selected = select::select(&variables, options).map_err(content)?;
    let settings = convert::settings(&selected, options.gain_unit).map_err(content)?;
    let text = settings.toml(title);
    let text = text.map_err(|e| content(format!("{e}; report this with the file")))?;
    let name = path.display().to_string();
    let transfer = |why: TransferError| ControllerError::Transfer {
        name: name.clone(),
        table: settings.table().key(),
        why,
    };
    let cascade = Cascade::of(&settings).map_err(transfer)?;
    // The file must be accepted as it will be read.
    let controller = ControllerText {
        name: name.clone(),
        text,
    };
    controller.design(settings.rate_hz().unwrap_or(ANY_RATE_HZ))?;
    Ok(Imported {
        settings,
        remarks: remarks::of(&selected, &cascade),
        cascade,
        text: controller.text,
    })
}

/// The variables of a file; its format is recognised by its first bytes.
///
/// # Errors
/// Another format, or damaged or too large content.
pub fn read_variables(bytes: &[u8]) -> Result<Variables, FormatError> {
    let first = bytes.iter().find(|byte| !byte.is_ascii_whitespace());
    if bytes.starts_with(b"PK") {
        npz::variables(bytes)
    } else if bytes.starts_with(b"\x93NUMPY") {
        Err(FormatError::Kind {
            what: "a single array of numpy",
            remedy: "save all arrays of the controller with numpy.savez('FILE.npz', num=num, den=den, Ts=Ts)",
        })
    } else if first == Some(&b'{') {
        json::variables(bytes)
    } else {
        mat::variables(bytes)
    }
}
