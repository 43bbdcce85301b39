//! Why an external record cannot be read.

use std::fmt;
use std::path::PathBuf;

use bench_arrays::ArraysError;
use thiserror::Error;

use super::content::ForeignFormat;

/// Why a file cannot be read as a record. Messages state file, line, value and remedy.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ExternalCsvError {
    /// The file cannot be read.
    #[error("cannot read {path}: {1}; check that it is a file and that you may read it", path = .0.display())]
    File(PathBuf, std::io::Error),
    /// The selected columns are missing, ambiguous or identical.
    #[error(transparent)]
    Columns(#[from] ColumnsError),
    /// The file is not a table of numbers with regular times.
    #[error(transparent)]
    Data(#[from] DataError),
}

/// Where a number stands, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of a text.
    Line(u64),
    /// A number of an array.
    Sample(u64),
}

impl Place {
    fn noun(self) -> &'static str {
        match self {
            Place::Line(_) => "line",
            Place::Sample(_) => "sample",
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (Place::Line(number) | Place::Sample(number)) = self;
        write!(f, "{} {number}", self.noun())
    }
}

/// Why columns cannot be selected.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ColumnsError {
    /// The same column for two purposes.
    #[error(
        "`{name}` is selected twice; give different columns for input, output, reference and time"
    )]
    SelectedTwice {
        /// Name of the column.
        name: String,
    },
    /// Several columns have this name.
    #[error(
        "{path} has more than one column `{name}`; give each a name of its own",
        path = .path.display()
    )]
    Ambiguous {
        /// The file.
        path: PathBuf,
        /// Name of the columns.
        name: String,
    },
    /// No column has this name.
    #[error(
        "{path} has no column `{name}`; choose one of {}",
        .available.join(", "),
        path = .path.display()
    )]
    Missing {
        /// The file.
        path: PathBuf,
        /// The given name.
        name: String,
        /// Names of the columns of the file.
        available: Vec<String>,
    },
    /// The columns have no names, and no such number.
    #[error(
        "{path} has no line with the names of its columns; select a column by its number, from 1 to {columns}, in place of `{name}`",
        path = .path.display()
    )]
    NoNames {
        /// The file.
        path: PathBuf,
        /// The given name.
        name: String,
        /// Number of columns.
        columns: usize,
    },
    /// A variable that is no column of real numbers.
    #[error(
        "`{name}` in {path} is {what}, not a column of real numbers; choose one of {}",
        .available.join(", "),
        path = .path.display()
    )]
    NoColumn {
        /// The file.
        path: PathBuf,
        /// Name of the variable.
        name: String,
        /// What it is.
        what: String,
        /// Names of the columns of the file.
        available: Vec<String>,
    },
    /// Arrays of different lengths.
    #[error(
        "{path}: `{first}` has {first_length} numbers and `{second}` has {second_length}; give arrays of the same length, one number per sample",
        path = .path.display()
    )]
    OtherLength {
        /// The file.
        path: PathBuf,
        /// A column.
        first: String,
        /// How many numbers it has.
        first_length: usize,
        /// Another column.
        second: String,
        /// How many numbers it has.
        second_length: usize,
    },
}

/// Why a file is not a table of numbers with regular times. Lines are those of the file, from 1.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DataError {
    /// The file has another format than text.
    #[error("{path} is {}, not a table of text; {}", .format.name(), .format.remedy(), path = .path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Its format.
        format: ForeignFormat,
    },
    /// The arrays of the file cannot be read.
    #[error("{path}: {why}; save it again, only with the variables of the record, or write them as CSV", path = .path.display())]
    Arrays {
        /// The file.
        path: PathBuf,
        /// Why.
        why: ArraysError,
    },
    /// A file of arrays without one that is a column.
    #[error("{path} has no arrays of several numbers{}; save the signals as arrays of numbers", in_brackets(.found), path = .path.display())]
    NoArrays {
        /// The file.
        path: PathBuf,
        /// What it has, as in `c is a cell array`.
        found: Vec<String>,
    },
    /// No line has two numbers.
    #[error(
        "{path} has no lines with numbers in at least two columns; check that it is a table with one sample per line",
        path = .path.display()
    )]
    NoColumns {
        /// The file.
        path: PathBuf,
    },
    /// The unit of the times is not known, and they are no seconds by their size.
    #[error(
        "{path}: the times in column `{column}` have steps of {step}, and neither the name nor a line of units states their unit; \
         give --time-unit s, ms, us, ns, min, h or d, or --rate HZ if it counts the samples",
        path = .path.display()
    )]
    NoTimeUnit {
        /// The file.
        path: PathBuf,
        /// Name of the column of times.
        column: String,
        /// Step in the unit of the file.
        step: f64,
    },
    /// The file states a unit of the times that is none of time.
    #[error(
        "{path}: column `{column}` is in `{unit}` by the file, which is no unit of time; give the column of times with --time, \
         --time-unit s, ms, us, ns, min, h or d if the unit is stated wrongly, or --rate HZ if the samples are equidistant in time",
        path = .path.display()
    )]
    OtherTimeUnit {
        /// The file.
        path: PathBuf,
        /// Name of the column of times.
        column: String,
        /// The unit of the file.
        unit: String,
    },
    /// The text is not a table.
    #[error(
        "{path}{}: {reason}; repair the file: a record is a table with one sample per line",
        after_path(*.line),
        path = .path.display()
    )]
    Table {
        /// The file.
        path: PathBuf,
        /// The line, if it is known.
        line: Option<u64>,
        /// What is wrong with it.
        reason: String,
    },
    /// Commas between the columns, and also in the numbers.
    #[error(
        "{path}, line {line}: has twice the columns of the header, \
         so the numbers seem to have a comma in place of the decimal point; write them as in 0.5",
        path = .path.display()
    )]
    DecimalCommas {
        /// The file.
        path: PathBuf,
        /// The line.
        line: u64,
    },
    /// A cell is not a finite number.
    #[error(
        "{path}, {place}: {text:?} in column `{column}` {}",
        number_remedy(.text),
        path = .path.display()
    )]
    Cell {
        /// The file.
        path: PathBuf,
        /// Its place.
        place: Place,
        /// Name of the column.
        column: String,
        /// Text of the cell.
        text: String,
    },
    /// Too few times for a rate.
    #[error(
        "{path} has fewer than two lines of samples ({lines}), and an estimate needs 64; record for longer",
        path = .path.display()
    )]
    TooFewLines {
        /// The file.
        path: PathBuf,
        /// Lines after the header.
        lines: usize,
    },
    /// A time is not after the one before.
    #[error(
        "{path}, {place}: the time {time_s} s in column `{column}` is not after \
         the previous time of {previous_s} s; sort the {}s, or cut the file there",
        .place.noun(),
        path = .path.display()
    )]
    NotRising {
        /// The file.
        path: PathBuf,
        /// Its place.
        place: Place,
        /// Name of the column of times.
        column: String,
        /// The time.
        time_s: f64,
        /// The time before it.
        previous_s: f64,
    },
    /// A time step differs from the others.
    #[error(
        "{path}, {place}: {step_s:.9} s after the {} before, where the usual step is {usual_s:.9} s; \
         fill the gap, cut the file there, or give --rate in place of --time if only the times are inaccurate",
        .place.noun(),
        path = .path.display()
    )]
    Irregular {
        /// The file.
        path: PathBuf,
        /// Its place.
        place: Place,
        /// Time since the one before.
        step_s: f64,
        /// Usual time between two.
        usual_s: f64,
    },
}

/// The line after the name of the file, if it is known.
fn after_path(line: Option<u64>) -> String {
    line.map_or_else(String::new, |line| format!(", line {line}"))
}

/// The contents of a file, for a message.
fn in_brackets(contents: &[String]) -> String {
    if contents.is_empty() {
        return String::new();
    }
    format!(" ({})", contents.join(", "))
}

/// What is wrong with a cell that is not a finite number.
fn number_remedy(text: &str) -> &'static str {
    let parts_of_a_date = text.bytes().filter(|byte| b"/:".contains(byte)).count();
    if text.is_empty() {
        "is an empty cell; fill it, or cut the file there"
    } else if parts_of_a_date >= 2 {
        "is not a date with a time as in 2026-11-26T12:40:48.002Z; write it in this form, or give --rate HZ in place of --time"
    } else if text.contains(',') && text.contains('.') {
        "has separators of thousands; write the numbers as in 1085.5"
    } else if text.contains(',') {
        "has a comma in place of the decimal point; write the numbers as in 0.5"
    } else {
        "is not a finite number; repair the cell, or cut the file there"
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::TimeUnit;
    use crate::table::Table;

    /// The error of a table with the columns t, u and y.
    fn error_of(rows: &str) -> ExternalCsvError {
        let names = ["u", "y", "t"].map(String::from);
        let table = Table::of(Path::new("data.csv"), format!("t,u,y\n{rows}"));
        let record = table.and_then(|table| {
            table.numbers_and_times([&names[0], &names[1]], &names[2], Some(TimeUnit::S))
        });
        record.map(drop).expect_err("an invalid table")
    }

    #[test]
    fn error_of_a_cell_holds_line_column_and_text() {
        let error = error_of("0,1,2\n1,1,off\n");
        let ExternalCsvError::Data(DataError::Cell {
            path,
            place,
            column,
            text,
        }) = &error
        else {
            panic!("{error:?}");
        };
        assert_eq!(
            (path.as_path(), *place),
            (Path::new("data.csv"), Place::Line(3))
        );
        assert_eq!((column.as_str(), text.as_str()), ("y", "off"));
        assert_eq!(
            error.to_string(),
            "data.csv, line 3: \"off\" in column `y` is not a finite number; repair the cell, or cut the file there"
        );
    }

    #[test]
    fn error_of_a_row_without_a_cell_holds_line_and_numbers_of_columns() {
        let error = error_of("0,1,2\n1,1\n");
        assert_eq!(
            error.to_string(),
            "data.csv, line 3: has 2 in place of 3 columns; repair the file: a record is a table with one sample per line"
        );
        let ExternalCsvError::Data(DataError::Table { line, reason, .. }) = error else {
            panic!("{error:?}");
        };
        assert_eq!(line, Some(3));
        assert_eq!(reason, "has 2 in place of 3 columns");
    }

    #[test]
    fn error_of_a_row_with_decimal_commas_holds_the_line() {
        let error = error_of("0,1,2\n0,5,1,0,2,0\n");
        let ExternalCsvError::Data(DataError::DecimalCommas { line, .. }) = error else {
            panic!("{error:?}");
        };
        assert_eq!(line, 3);
    }

    #[test]
    fn error_of_an_irregular_time_holds_line_and_steps() {
        let error = error_of("0,1,2\n1,1,2\n2,1,2\n4.5,1,2\n");
        let ExternalCsvError::Data(DataError::Irregular {
            place,
            step_s,
            usual_s,
            ..
        }) = error
        else {
            panic!("{error:?}");
        };
        assert_eq!((place, step_s, usual_s), (Place::Line(5), 2.5, 1.0));
    }

    #[test]
    fn error_of_a_time_that_does_not_rise_holds_both_times() {
        let error = error_of("0,1,2\n1,1,2\n0.5,1,2\n");
        let ExternalCsvError::Data(DataError::NotRising {
            place,
            time_s,
            previous_s,
            ..
        }) = error
        else {
            panic!("{error:?}");
        };
        assert_eq!((place, time_s, previous_s), (Place::Line(4), 0.5, 1.0));
    }

    #[test]
    fn error_of_an_unknown_column_holds_the_available_ones() {
        let table = Table::of(Path::new("data.csv"), "t,u,y\n0,1,2\n1,2,3\n".into());
        let names = ["u", "v"].map(String::from);
        let found = table.and_then(|table| table.numbers([&names[0], &names[1]]));
        let error = found.expect_err("no column v");
        assert_eq!(
            error.to_string(),
            "data.csv has no column `v`; choose one of t, u, y"
        );
        let ExternalCsvError::Columns(ColumnsError::Missing { available, .. }) = error else {
            panic!("{error:?}");
        };
        assert_eq!(available, ["t", "u", "y"]);
    }
}
