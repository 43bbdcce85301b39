//! Records and frequency responses ([`frf`]) of other programs: tables of text, one sample or frequency per line, and arrays.
//!
//! ```text
//! file -> content (gzip, UTF-8, UTF-16, Latin-1; other formats are named)
//!      -> text: layout (preamble, names, units, separator) -> table (numbers of the selected columns) ---> times (unit, regular or not)
//!      -> arrays (MAT-file, NPZ, NPY, universal file) -> series of the selected names ------------------/      -> signals
//! ```
//!
//! Input and output may have any units: the [`Signals`] have them as well, and a residue is output per input per second squared.

#![deny(unsafe_code)]

mod array_table;
mod cells;
mod content;
mod error;
pub mod frf;
mod layout;
mod open;
mod source;
mod stamp;
mod table;
mod times;

pub use content::ForeignFormat;
pub use error::{ColumnsError, DataError, ExternalCsvError, Place};
pub use times::{TimeBase, TimeUnit};

use std::path::Path;

use bench_identify::Signals;
use bench_identify::resampling::Readings;

use source::Source;
use times::Times;

/// The columns of a record.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// Name of the input column.
    pub input: String,
    /// Name of the output column.
    pub output: String,
    /// Times of the samples.
    pub sampling: Sampling,
}

/// Times of the samples.
#[derive(Clone, Debug, PartialEq)]
pub enum Sampling {
    /// A column of times.
    TimeColumn {
        /// Its name.
        name: String,
        /// Its unit; that of the file without one.
        unit: Option<TimeUnit>,
    },
    /// Samples per second.
    RateHz(f64),
}

/// A record, with what its times are.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Input and output at regular times.
    pub signals: Signals,
    /// The times of the file.
    pub times: TimeBase,
    /// Whether the times are taken as seconds only because the file does not state their unit.
    pub seconds_assumed: bool,
}

/// Reads two columns as a record.
///
/// # Errors
/// When the file is no table and has no arrays, lacks a column, holds something else than numbers, or when its times are not known: see
/// [`ExternalCsvError`]. Use [`Signals::check`] to check that an estimator can process the signals.
pub fn read(path: &Path, columns: &Columns) -> Result<Record, ExternalCsvError> {
    let source = Source::open(path)?;
    match &columns.sampling {
        Sampling::RateHz(rate_hz) => {
            let [input, output] = source.numbers([&columns.input, &columns.output])?;
            Ok(Record {
                signals: Signals {
                    rate_hz: *rate_hz,
                    input,
                    output,
                },
                times: TimeBase::Given,
                seconds_assumed: false,
            })
        }
        Sampling::TimeColumn { name, unit } => {
            let names = [&columns.input, &columns.output];
            let (signals, times) = source.numbers_and_times(names, name, *unit)?;
            let [input, output] = signals.map(|values| at_regular_times(values, &times));
            Ok(Record {
                signals: Signals {
                    rate_hz: times.rate_hz,
                    input,
                    output,
                },
                times: times.base,
                seconds_assumed: times.seconds_assumed,
            })
        }
    }
}

/// A signal at regular times: as it is, if its times are regular, or else resampled.
fn at_regular_times(values: Vec<f64>, times: &Times) -> Vec<f64> {
    let TimeBase::Resampled { .. } = times.base else {
        return values;
    };
    let count = values.len();
    let mut readings = Readings::default();
    for (time_s, value) in times.time_s.iter().zip(values) {
        readings.push(*time_s, value);
    }
    readings.at_regular_times(0.0, times.period_s, count)
}

/// The names of the columns of a file; their numbers from 1 if it has none.
///
/// # Errors
/// When the file cannot be read, is not a table, and has no arrays.
pub fn names(path: &Path) -> Result<Vec<String>, ExternalCsvError> {
    Ok(Source::open(path)?.names())
}

/// The names of the columns of a file as text, with the single numbers of a file of arrays, one of which may be the rate:
/// `t, u, y; single numbers: fs = 1000`.
///
/// # Errors
/// Those of [`names`].
pub fn listing(path: &Path) -> Result<String, ExternalCsvError> {
    let source = Source::open(path)?;
    let names = source.names().join(", ");
    let numbers: Vec<String> = source
        .scalars()
        .iter()
        .map(|(name, number)| format!("{name} = {number}"))
        .collect();
    Ok(if numbers.is_empty() {
        names
    } else {
        format!("{names}; single numbers: {}", numbers.join(", "))
    })
}
