//! Records of other hands: a CSV whose first line names its columns, one sample a line.
//!
//! Commas, semicolons or tabs part the columns, whichever the first line has most of. Input and output may be in any units:
//! what [`Signals`] calls amperes and metres are then those, and a residue is output per input per second squared.

use std::path::{Path, PathBuf};

use thiserror::Error;

use super::Signals;

/// A step of time may differ from the median step by this part of it: what rounding of the stamps to a few digits does.
const IRREGULAR: f64 = 0.1;

/// Which columns, and when they were sampled.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    /// Name of the column of what drives.
    pub input: String,
    /// Name of the column of what answers.
    pub output: String,
    /// When.
    pub clock: Clock,
}

/// When the lines were sampled.
#[derive(Clone, Debug, PartialEq)]
pub enum Clock {
    /// A column of regular times in seconds.
    Column(String),
    /// Samples per second.
    RateHz(f64),
}

/// Why a table is no record.
#[derive(Debug, Error)]
pub enum ExternalCsvError {
    /// The file system said no.
    #[error("{path}: {source}")]
    Io {
        /// The file.
        path: PathBuf,
        /// What it said.
        source: std::io::Error,
    },
    /// It is not a table.
    #[error("{path} is not a table with one sample a line: {source}")]
    NoTable {
        /// The file.
        path: PathBuf,
        /// What the reader says, with the line.
        source: csv::Error,
    },
    /// There is no such column.
    #[error("{path} has no column `{name}`; its columns are {there}")]
    NoColumn {
        /// The file.
        path: PathBuf,
        /// The name asked for.
        name: String,
        /// The names there are.
        there: String,
    },
    /// A name stands for two columns.
    #[error("{path} has more than one column `{name}`; give them names of their own")]
    Ambiguous {
        /// The file.
        path: PathBuf,
        /// The name asked for.
        name: String,
    },
    /// Two of input, output and time are the same column.
    #[error("`{name}` is asked for twice; input, output and time are columns of their own")]
    Same {
        /// The name asked for.
        name: String,
    },
    /// A cell that holds no number.
    #[error(
        "{path}, line {line}: {text:?} in column `{column}` is not a finite number; repair the cell, or cut the file there"
    )]
    Cell {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// What stands there.
        text: String,
    },
    /// Too short to have a rate.
    #[error(
        "{path} has {samples} lines of samples; at least 2 have a rate, and an estimate takes 64"
    )]
    TooShort {
        /// The file.
        path: PathBuf,
        /// Samples there are.
        samples: usize,
    },
    /// Time stands still or runs backwards.
    #[error(
        "{path}, line {line}: the time {time_s} s in column `{column}` is not after the {before_s} s before it; sort the lines, or cut the file there"
    )]
    Backwards {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: u64,
        /// Name of the column.
        column: String,
        /// The time there.
        time_s: f64,
        /// The time before.
        before_s: f64,
    },
    /// Samples are missing, or the rate changes.
    #[error(
        "{path}, line {line}: {step_s:.9} s after the line before, where the median step is {median_s:.9} s; fill the gap, cut the file there, or give --rate instead of --time if only the stamps are rough"
    )]
    Irregular {
        /// The file.
        path: PathBuf,
        /// Line, counted from 1.
        line: u64,
        /// The step there.
        step_s: f64,
        /// The median step.
        median_s: f64,
    },
}

/// Reads two columns as a record.
///
/// # Errors
/// When the file is no table, lacks a column, holds something else than numbers, or its times are not regular: see
/// [`ExternalCsvError`]. Whether the signals are fit for an estimator is [`Signals::check`]'s to say.
pub fn read(path: &Path, columns: &Columns) -> Result<Signals, ExternalCsvError> {
    let text = std::fs::read(path).map_err(|source| ExternalCsvError::Io {
        path: path.to_owned(),
        source,
    })?;
    let table = Table {
        path,
        delimiter: delimiter(&text),
        text: &text,
    };
    let time = match &columns.clock {
        Clock::Column(name) => Some(name.as_str()),
        Clock::RateHz(_) => None,
    };
    let names: Vec<&str> = [columns.input.as_str(), columns.output.as_str()]
        .into_iter()
        .chain(time)
        .collect();
    let Numbers { lines, mut numbers } = table.numbers(&names)?;
    let rate_hz = match (&columns.clock, numbers.get(2)) {
        (Clock::Column(name), Some(time_s)) => table.rate_hz(name, time_s, &lines)?,
        (Clock::RateHz(rate_hz), _) => *rate_hz,
        // A third column was asked for, and so there is one.
        (Clock::Column(_), None) => f64::NAN,
    };
    let output_m = numbers.swap_remove(1);
    Ok(Signals {
        rate_hz,
        input_a: numbers.swap_remove(0),
        output_m,
    })
}

/// The names of the columns of a table.
///
/// # Errors
/// When the file cannot be read, or its first line holds no names.
pub fn names(path: &Path) -> Result<Vec<String>, ExternalCsvError> {
    let text = std::fs::read(path).map_err(|source| ExternalCsvError::Io {
        path: path.to_owned(),
        source,
    })?;
    let table = Table {
        path,
        delimiter: delimiter(&text),
        text: &text,
    };
    let header = table
        .reader()
        .headers()
        .cloned()
        .map_err(|source| table.no_table(source))?;
    Ok(header.iter().map(String::from).collect())
}

/// What parts the columns: of comma, semicolon and tab the one that the first line has most of.
fn delimiter(text: &[u8]) -> u8 {
    let first = text.split(|byte| *byte == b'\n').next().unwrap_or_default();
    let count = |mark: &u8| first.iter().filter(|byte| *byte == mark).count();
    [b'\t', b';', b',']
        .into_iter()
        .max_by_key(count)
        .unwrap_or(b',')
}

struct Table<'a> {
    path: &'a Path,
    delimiter: u8,
    text: &'a [u8],
}

/// Columns of numbers, and the line in the file of each.
struct Numbers {
    lines: Vec<u64>,
    numbers: Vec<Vec<f64>>,
}

impl Table<'_> {
    fn reader(&self) -> csv::Reader<&[u8]> {
        csv::ReaderBuilder::new()
            .delimiter(self.delimiter)
            .trim(csv::Trim::All)
            .from_reader(self.text)
    }

    fn no_table(&self, source: csv::Error) -> ExternalCsvError {
        ExternalCsvError::NoTable {
            path: self.path.to_owned(),
            source,
        }
    }

    fn numbers(&self, names: &[&str]) -> Result<Numbers, ExternalCsvError> {
        let mut reader = self.reader();
        let header = reader
            .headers()
            .cloned()
            .map_err(|source| self.no_table(source))?;
        let places = self.places(&header, names)?;
        let mut found = Numbers {
            lines: Vec::new(),
            numbers: vec![Vec::new(); names.len()],
        };
        for record in reader.records() {
            let record = record.map_err(|source| self.no_table(source))?;
            let line = record.position().map_or(0, csv::Position::line);
            found.lines.push(line);
            for ((numbers, place), name) in found.numbers.iter_mut().zip(&places).zip(names) {
                numbers.push(self.number(record.get(*place).unwrap_or_default(), line, name)?);
            }
        }
        Ok(found)
    }

    fn places(
        &self,
        header: &csv::StringRecord,
        names: &[&str],
    ) -> Result<Vec<usize>, ExternalCsvError> {
        let twice = |(k, name): &(usize, &&str)| names[..*k].contains(*name);
        if let Some((_, name)) = names.iter().enumerate().find(twice) {
            return Err(ExternalCsvError::Same {
                name: name.to_string(),
            });
        }
        names.iter().map(|name| self.place(header, name)).collect()
    }

    fn place(&self, header: &csv::StringRecord, name: &str) -> Result<usize, ExternalCsvError> {
        let (path, name) = (self.path.to_owned(), name.to_owned());
        let mut places = header
            .iter()
            .enumerate()
            .filter(|(_, there)| *there == name)
            .map(|(place, _)| place);
        match (places.next(), places.next()) {
            (Some(place), None) => Ok(place),
            (Some(_), Some(_)) => Err(ExternalCsvError::Ambiguous { path, name }),
            (None, _) => Err(ExternalCsvError::NoColumn {
                path,
                name,
                there: header.iter().collect::<Vec<_>>().join(", "),
            }),
        }
    }

    fn number(&self, text: &str, line: u64, column: &str) -> Result<f64, ExternalCsvError> {
        let number = text.parse().ok().filter(|number: &f64| number.is_finite());
        let (path, column, text) = (self.path.to_owned(), column.to_owned(), text.to_owned());
        number.ok_or(ExternalCsvError::Cell {
            path,
            line,
            column,
            text,
        })
    }

    /// Samples per second, from the first to the last.
    fn rate_hz(
        &self,
        column: &str,
        time_s: &[f64],
        lines: &[u64],
    ) -> Result<f64, ExternalCsvError> {
        let [first_s, .., last_s] = time_s else {
            return Err(ExternalCsvError::TooShort {
                path: self.path.to_owned(),
                samples: time_s.len(),
            });
        };
        let steps_s: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        if let Some(k) = steps_s.iter().position(|step_s| *step_s <= 0.0) {
            let (path, column) = (self.path.to_owned(), column.to_owned());
            let (time_s, before_s) = (time_s[k + 1], time_s[k]);
            return Err(ExternalCsvError::Backwards {
                path,
                line: lines[k + 1],
                column,
                time_s,
                before_s,
            });
        }
        let median_s = median(&steps_s);
        let irregular = |step_s: &f64| (step_s - median_s).abs() > IRREGULAR * median_s;
        if let Some(k) = steps_s.iter().position(irregular) {
            let path = self.path.to_owned();
            return Err(ExternalCsvError::Irregular {
                path,
                line: lines[k + 1],
                step_s: steps_s[k],
                median_s,
            });
        }
        Ok(steps_s.len() as f64 / (last_s - first_s))
    }
}

/// The middle of some values, of which there is one at least.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}
