//! Why a table is no frequency response.

use std::path::PathBuf;

use bench_identify::frf_value::ValueDefect;
use thiserror::Error;

use super::unit::ResponseUnit;
use crate::error::{ExternalCsvError, Place};

/// A valid line of names, for messages.
const EXAMPLE: &str = "frequency_hz,magnitude_m_per_a,phase_deg";

/// Why a table cannot be read as a frequency response. Messages state file, line, column, value and remedy.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FrfTableError {
    /// The file is not a table of numbers.
    #[error(transparent)]
    Table(#[from] ExternalCsvError),
    /// A required column is missing.
    #[error(
        "{path} has no column of the {what} (columns: {}); name the columns as in `{EXAMPLE}`, with magnitude_db, phase_rad, or real and imag in place of magnitude and phase",
        .available.join(", "),
        path = .path.display()
    )]
    Missing {
        /// The file.
        path: PathBuf,
        /// What is missing.
        what: &'static str,
        /// Names of the columns.
        available: Vec<String>,
    },
    /// Two columns for the same quantity.
    #[error("{path}: columns `{first}` and `{second}` are the same quantity by their names; leave one of them out", path = .path.display())]
    Twice {
        /// The file.
        path: PathBuf,
        /// A column.
        first: String,
        /// Another one.
        second: String,
    },
    /// The unit of the response is not metres per ampere.
    #[error("{path}: column `{column}` is not in m/A by its name; give a response from current (A) to displacement (m), converted to m/A", path = .path.display())]
    Unit {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
    },
    /// Real and imaginary part in different units.
    #[error("{path}: column `{column}` is in {unit}, but the other part of the response in {other}; give both in one unit", path = .path.display(), unit = .units[1], other = .units[0])]
    TwoUnits {
        /// The file.
        path: PathBuf,
        /// The column of the imaginary part.
        column: String,
        /// The units of real and imaginary part.
        units: Box<[ResponseUnit; 2]>,
    },
    /// A standard deviation in another unit than the response.
    #[error("{path}: column `{column}` is not in the unit of the response by its name; give the standard deviation of the magnitude in its linear unit, or leave out the column: it is then estimated from the scatter of the response", path = .path.display())]
    SigmaUnit {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
    },
    /// A velocity or an acceleration as output.
    #[error("{path}: column `{column}` is the response of a velocity or an acceleration by its name; give --output-kind velocity or --output-kind acceleration", path = .path.display())]
    Derivative {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
    },
    /// Columns without names whose numbers do not tell what they are.
    #[error("{path} has no line with the names of its columns, and by their numbers they may be magnitude and phase, or real and imaginary part; write such a line, for example `{EXAMPLE}` or `frequency_hz,real,imag`", path = .path.display())]
    Unnamed {
        /// The file.
        path: PathBuf,
    },
    /// The unit of the phases is not known.
    #[error("{path}: column `{column}` states no unit, and the largest phase of {largest:.4} may be in degrees or in radians; give --frf-phase deg or --frf-phase rad", path = .path.display())]
    PhaseUnit {
        /// The file.
        path: PathBuf,
        /// The column.
        column: String,
        /// Largest magnitude of a phase.
        largest: f64,
    },
    /// A frequency that is not above the one before.
    #[error("{path}, {place}: {value} in column `{column}` is not a frequency above the one before ({previous}); sort them by frequency", path = .path.display())]
    NotRising {
        /// The file.
        path: PathBuf,
        /// Its place.
        place: Place,
        /// The column.
        column: String,
        /// The frequency in the unit of the file.
        value: f64,
        /// The one before.
        previous: f64,
    },
    /// A number that no measurement has.
    #[error("{path}, {place}, column `{column}`: {value} {defect}", path = .path.display())]
    Value {
        /// The file.
        path: PathBuf,
        /// Its place.
        place: Place,
        /// The column.
        column: String,
        /// The value.
        value: f64,
        /// What is wrong, with the remedy.
        defect: ValueDefect,
    },
    /// The unit of the frequencies of a file of arrays is not known.
    #[error("{path}: {place} states {}, not Hz or rad/s; state the unit, or save the frequencies as `frequency_hz` or `frequency_rad_s` and the complex response as `response`", stated(.unit), path = .path.display())]
    FrequencyUnit {
        /// The file.
        path: PathBuf,
        /// Where it would stand.
        place: String,
        /// What stands there.
        unit: String,
    },
    /// A universal file without a frequency response.
    #[error("{path} has no frequency response (dataset 58 of function type 4); export the response from current to displacement", path = .path.display())]
    NoResponse {
        /// The file.
        path: PathBuf,
    },
    /// Several responses in a universal file.
    #[error("{path} has {} frequency responses ({}); save only the one from current to displacement", .names.len(), .names.join(", "), path = .path.display())]
    Several {
        /// The file.
        path: PathBuf,
        /// Names of the responses.
        names: Vec<String>,
    },
    /// The standard deviations cannot be estimated.
    #[error("{path} has no standard deviations, and they cannot be estimated from the scatter of {points} frequencies (at least {least}, with a response above 0); add a column magnitude_sigma (m/A), or measure more frequencies", path = .path.display())]
    NoScatter {
        /// The file.
        path: PathBuf,
        /// Number of frequencies.
        points: usize,
        /// The fewest from which they can be estimated.
        least: usize,
    },
}

fn stated(unit: &str) -> String {
    if unit.is_empty() {
        "no unit".into()
    } else {
        format!("the unit `{unit}`")
    }
}
