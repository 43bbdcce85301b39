//! Records and frequency responses ([`frf`]) of other programs: tables of text, one sample or frequency per line, and arrays.
//!
//! ```text
//! file -> content (gzip, UTF-8, UTF-16, Latin-1; other formats are named)
//!      -> text: layout (preamble, names, units, separator) -> table (numbers of the selected columns) ---> times (unit, regular or not)
//!      -> arrays (MAT-file, NPZ, universal file, ...) -> series of the selected names ------------------/      -> signals
//! ```
//!
//! Input, output and the reference of a closed loop may have any units: the [`Signals`] have them as well, and a residue is output per
//! input per second squared.

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
    /// Name of the column of the reference of a closed loop.
    pub reference: Option<String>,
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
    /// The reference at the same times, if a column was selected.
    pub reference: Option<Vec<f64>>,
    /// The times of the file.
    pub times: TimeBase,
    /// Whether the times are taken as seconds only because the file does not state their unit.
    pub seconds_assumed: bool,
}

/// Reads the columns of a record.
///
/// # Errors
/// When the file is no table and has no arrays, lacks a column, holds something else than numbers, or when its times are not known: see
/// [`ExternalCsvError`]. Use [`Signals::check`] to check that an estimator can process the signals.
pub fn read(path: &Path, columns: &Columns) -> Result<Record, ExternalCsvError> {
    let source = Source::open(path)?;
    let Columns {
        input,
        output,
        reference,
        sampling,
    } = columns;
    let Some(reference) = reference else {
        let samples = Samples::read(&source, [input, output], sampling)?;
        return Ok(samples.record(|[input, output]| (input, output, None)));
    };
    let samples = Samples::read(&source, [input, output, reference], sampling)?;
    Ok(samples.record(|[input, output, reference]| (input, output, Some(reference))))
}

/// Columns at regular times.
struct Samples<const N: usize> {
    columns: [Vec<f64>; N],
    rate_hz: f64,
    times: TimeBase,
    seconds_assumed: bool,
}

impl<const N: usize> Samples<N> {
    fn read(
        source: &Source<'_>,
        names: [&String; N],
        sampling: &Sampling,
    ) -> Result<Samples<N>, ExternalCsvError> {
        match sampling {
            Sampling::RateHz(rate_hz) => Ok(Samples {
                columns: source.numbers(names)?,
                rate_hz: *rate_hz,
                times: TimeBase::Given,
                seconds_assumed: false,
            }),
            Sampling::TimeColumn { name, unit } => {
                let (columns, times) = source.numbers_and_times(names, name, *unit)?;
                Ok(Samples {
                    columns: columns.map(|values| at_regular_times(values, &times)),
                    rate_hz: times.rate_hz,
                    times: times.base,
                    seconds_assumed: times.seconds_assumed,
                })
            }
        }
    }

    /// The record of these columns, from which a function takes input, output and reference.
    fn record(
        self,
        signals: impl FnOnce([Vec<f64>; N]) -> (Vec<f64>, Vec<f64>, Option<Vec<f64>>),
    ) -> Record {
        let (input, output, reference) = signals(self.columns);
        Record {
            signals: Signals {
                rate_hz: self.rate_hz,
                input,
                output,
            },
            reference,
            times: self.times,
            seconds_assumed: self.seconds_assumed,
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
