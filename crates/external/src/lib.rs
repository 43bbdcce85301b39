//! External records: CSV files with a header that names the columns, one sample per line.
//!
//! Columns are separated by commas, semicolons or tabs, whichever is most frequent in the first line. Input and output may have
//! any units: the [`Signals`] have them as well, and a residue is output per input per second squared.

#![deny(unsafe_code)]

mod error;

use std::path::Path;

pub use error::{ColumnsError, DataError, ExternalCsvError};

use bench_base::input_file::{self, MAX_RECORD_BYTES};
use bench_identify::Signals;

/// Largest deviation of a time step from the median step, as a ratio: that of times rounded to a few digits.
const MAX_IRREGULARITY: f64 = 0.1;

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
    /// Name of a column of regular times in seconds.
    TimeColumn(String),
    /// Samples per second.
    RateHz(f64),
}

/// Reads two columns as a record.
///
/// # Errors
/// When the file is not a table, lacks a column, holds something else than numbers, or its times are irregular: see
/// [`ExternalCsvError`]. Use [`Signals::check`] to check that an estimator can process the signals.
pub fn read(path: &Path, columns: &Columns) -> Result<Signals, ExternalCsvError> {
    let table = Table::open(path)?;
    let mut names = vec![columns.input.as_str(), columns.output.as_str()];
    if let Sampling::TimeColumn(time) = &columns.sampling {
        names.push(time);
    }
    let Numbers { lines, mut values } = table.numbers(&names)?;
    let rate_hz = match &columns.sampling {
        Sampling::RateHz(rate_hz) => *rate_hz,
        Sampling::TimeColumn(time) => table.rate_hz(time, &values[2], &lines)?,
    };
    let output = values.swap_remove(1);
    let input = values.swap_remove(0);
    Ok(Signals {
        rate_hz,
        input,
        output,
    })
}

/// The names of the columns of a file.
///
/// # Errors
/// When the file cannot be read, or its first line is not a header.
pub fn names(path: &Path) -> Result<Vec<String>, ExternalCsvError> {
    let table = Table::open(path)?;
    let header = table.header(&mut table.reader())?;
    Ok(header.iter().map(String::from).collect())
}

/// The most frequent separator in the first line: comma, semicolon or tab.
fn separator(text: &[u8]) -> u8 {
    let first = text.split(|byte| *byte == b'\n').next().unwrap_or_default();
    [b'\t', b';', b',']
        .into_iter()
        .max_by_key(|separator| first.iter().filter(|byte| *byte == separator).count())
        .unwrap_or(b',')
}

/// The text in UTF-8, without a byte order mark. Other text is taken for Latin-1, in which every byte is a character.
fn utf8(text: Vec<u8>) -> Vec<u8> {
    if let Some(rest) = text.strip_prefix(b"\xef\xbb\xbf") {
        return rest.to_vec();
    }
    match std::str::from_utf8(&text) {
        Ok(_) => text,
        Err(_) => text
            .iter()
            .map(|byte| char::from(*byte))
            .collect::<String>()
            .into_bytes(),
    }
}

struct Table<'a> {
    path: &'a Path,
    text: Vec<u8>,
}

/// The selected columns of a table.
struct Selection<'a> {
    names: &'a [&'a str],
    /// Indices in a row of the file.
    indices: Vec<usize>,
}

/// Columns of numbers, with the line of each row in the file.
struct Numbers {
    lines: Vec<u64>,
    values: Vec<Vec<f64>>,
}

impl Table<'_> {
    fn open(path: &Path) -> Result<Table<'_>, ExternalCsvError> {
        let text = input_file::read(path, MAX_RECORD_BYTES);
        let text = text.map_err(|source| ExternalCsvError::File(path.to_owned(), source))?;
        let text = utf8(text);
        Ok(Table { path, text })
    }

    fn reader(&self) -> csv::Reader<&[u8]> {
        csv::ReaderBuilder::new()
            .delimiter(separator(&self.text))
            .trim(csv::Trim::All)
            .from_reader(&self.text)
    }

    fn header(&self, reader: &mut csv::Reader<&[u8]>) -> Result<csv::StringRecord, DataError> {
        let header = reader.headers().cloned();
        header.map_err(|error| self.not_a_table(&error))
    }

    fn not_a_table(&self, error: &csv::Error) -> DataError {
        let path = self.path.to_owned();
        let line = error.position().map(csv::Position::line);
        let csv::ErrorKind::UnequalLengths {
            expected_len: header,
            len: columns,
            ..
        } = error.kind()
        else {
            let reason = error.to_string();
            return DataError::Table { path, line, reason };
        };
        // Commas in the numbers make two columns of one.
        match line {
            Some(line) if separator(&self.text) == b',' && *columns == 2 * header => {
                DataError::DecimalCommas { path, line }
            }
            _ => DataError::Table {
                path,
                line,
                reason: format!("has {columns} in place of {header} columns"),
            },
        }
    }

    fn numbers(&self, names: &[&str]) -> Result<Numbers, ExternalCsvError> {
        let mut reader = self.reader();
        let header = self.header(&mut reader)?;
        let indices = self.column_indices(&header, names)?;
        let selection = Selection { names, indices };
        let mut numbers = Numbers {
            lines: Vec::new(),
            values: vec![Vec::new(); names.len()],
        };
        for record in reader.records() {
            let record = record.map_err(|error| self.not_a_table(&error))?;
            self.push_row(&record, &selection, &mut numbers)?;
        }
        Ok(numbers)
    }

    /// Appends the selected columns of a row.
    fn push_row(
        &self,
        record: &csv::StringRecord,
        selection: &Selection<'_>,
        numbers: &mut Numbers,
    ) -> Result<(), DataError> {
        let line = record.position().map_or(0, csv::Position::line);
        numbers.lines.push(line);
        let columns = selection.indices.iter().zip(selection.names);
        for (values, (index, name)) in numbers.values.iter_mut().zip(columns) {
            let text = record.get(*index).unwrap_or_default();
            values.push(self.number(text, line, name)?);
        }
        Ok(())
    }

    fn column_indices(
        &self,
        header: &csv::StringRecord,
        names: &[&str],
    ) -> Result<Vec<usize>, ColumnsError> {
        let duplicate = (1..names.len()).find(|k| names[..*k].contains(&names[*k]));
        if let Some(name) = duplicate.map(|k| names[k]) {
            return Err(ColumnsError::SelectedTwice {
                name: (*name).into(),
            });
        }
        names
            .iter()
            .map(|name| self.column_index(header, name))
            .collect()
    }

    fn column_index(&self, header: &csv::StringRecord, name: &str) -> Result<usize, ColumnsError> {
        let (path, given) = (self.path.to_owned(), name.to_owned());
        let mut matches = (0..header.len()).filter(|index| &header[*index] == name);
        match (matches.next(), matches.next()) {
            (Some(index), None) => Ok(index),
            (Some(_), Some(_)) => Err(ColumnsError::Ambiguous { path, name: given }),
            (None, _) => Err(ColumnsError::Missing {
                path,
                name: given,
                available: header.iter().map(String::from).collect(),
            }),
        }
    }

    fn number(&self, text: &str, line: u64, column: &str) -> Result<f64, DataError> {
        let number = text.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| DataError::Cell {
            path: self.path.to_owned(),
            line,
            column: column.into(),
            text: text.into(),
        })
    }

    /// Samples per second, from the first to the last.
    fn rate_hz(&self, column: &str, time_s: &[f64], lines: &[u64]) -> Result<f64, DataError> {
        let [first_s, .., last_s] = time_s else {
            return Err(DataError::TooFewLines {
                path: self.path.to_owned(),
                lines: time_s.len(),
            });
        };
        self.check_rising(column, time_s, lines)?;
        let steps_s: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
        self.check_regular(&steps_s, lines)?;
        Ok(steps_s.len() as f64 / (last_s - first_s))
    }

    fn check_rising(&self, column: &str, time_s: &[f64], lines: &[u64]) -> Result<(), DataError> {
        let mut steps = time_s.windows(2);
        let Some(k) = steps.position(|pair| pair[1] - pair[0] <= 0.0) else {
            return Ok(());
        };
        Err(DataError::NotRising {
            path: self.path.to_owned(),
            line: lines[k + 1],
            column: column.into(),
            time_s: time_s[k + 1],
            previous_s: time_s[k],
        })
    }

    fn check_regular(&self, steps_s: &[f64], lines: &[u64]) -> Result<(), DataError> {
        let median_s = median(steps_s);
        let limit_s = MAX_IRREGULARITY * median_s;
        let mut deviations_s = steps_s.iter().map(|step_s| (step_s - median_s).abs());
        let Some(k) = deviations_s.position(|deviation_s| deviation_s > limit_s) else {
            return Ok(());
        };
        Err(DataError::Irregular {
            path: self.path.to_owned(),
            line: lines[k + 1],
            step_s: steps_s[k],
            median_s,
        })
    }
}

/// The median of at least one value.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[sorted.len() / 2]
}
