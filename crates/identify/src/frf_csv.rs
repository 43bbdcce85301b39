//! Frequency response functions as CSV files.
//!
//! One row per frequency. Phases are wrapped to (-180, 180] degrees; a lag is negative. Numbers are written with
//! enough digits to read back the same value.

use std::io;
use std::path::{Path, PathBuf};

use nalgebra::Complex;
use thiserror::Error;

use super::Frf;
use super::frf_value::{ValueDefect, coherence_defect, sigma_defect};
use bench_base::input_file::{self, MAX_TABLE_BYTES};

/// Name of the magnitude column of a response from current to displacement.
pub const METRES_PER_AMPERE: &str = "magnitude_m_per_a";
/// Name of the magnitude column of a response from displacement to current.
pub const AMPERES_PER_METRE: &str = "magnitude_a_per_m";
/// Name of the magnitude column of a ratio, such as a sensitivity.
pub const RATIO: &str = "magnitude";

/// The columns of a response from current to displacement, in this order.
pub const HEADER: &str = "frequency_hz,magnitude_m_per_a,phase_deg,coherence,magnitude_sigma,phase_sigma_deg,resolution_hz";

/// Name of the column of the standard deviations of the magnitude.
pub const MAGNITUDE_SIGMA: &str = "magnitude_sigma";

/// Number of columns of [`HEADER`].
pub const COLUMNS: usize = 7;

const REPAIR: &str = "repair the line, or write the file again with `bench identify`";

/// Why an FRF cannot be read.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum FrfCsvError {
    /// The file cannot be read.
    #[error("cannot read {path}: {1}; check that it is a file and that you may read it", path = .0.display())]
    File(PathBuf, io::Error),
    /// The first line is not [`HEADER`].
    #[error("the first line is {found:?}, not {HEADER:?}; give an FRF file of `bench identify`")]
    Header {
        /// The first line.
        found: String,
    },
    /// A response in another unit: only the name of the magnitude column differs from [`HEADER`].
    #[error(
        "the magnitude column is `{name}`, not `{METRES_PER_AMPERE}`; \
         give a response from current (A) to displacement (m), such as ..._frf.csv of `bench chirp`"
    )]
    Unit {
        /// Name of the magnitude column.
        name: String,
    },
    /// A row is not a number for each column, or its frequency is not above the one before.
    #[error(
        "line {line}: {text:?} is not {COLUMNS} finite numbers with a frequency above the one before; {REPAIR}"
    )]
    Row {
        /// Line in the file, from 1.
        line: u64,
        /// The row.
        text: String,
    },
    /// A cell is not a finite number.
    #[error(
        "line {line}, column `{column}`: {text:?} is not a finite number (in {row:?}); {REPAIR}"
    )]
    Cell {
        /// Line in the file, from 1.
        line: u64,
        /// Name of the column.
        column: &'static str,
        /// The cell.
        text: String,
        /// The row.
        row: String,
    },
    /// A standard deviation or coherence that no measurement has.
    #[error("line {line}, column `{column}`: {value} {defect}")]
    Value {
        /// Line in the file, from 1.
        line: u64,
        /// Name of the column.
        column: &'static str,
        /// The value.
        value: f64,
        /// What is wrong, with the remedy.
        defect: ValueDefect,
    },
    /// The text is not a table.
    #[error("{reason}; {REPAIR}")]
    Table {
        /// Why not, with the line if it is known.
        reason: String,
    },
}

/// Name of the magnitude column of an external record, with the names of its columns in place of units.
pub fn external_magnitude(input: &str, output: &str) -> String {
    format!("magnitude_{output}_per_{input}")
}

/// The FRF as text; `magnitude` names the magnitude column.
pub fn to_string(frf: &Frf, magnitude: &str) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let header = HEADER.split(',').map(|name| {
        if name == METRES_PER_AMPERE {
            magnitude
        } else {
            name
        }
    });
    // Writing to memory cannot fail, and all rows have the length of the header.
    let _ = writer.write_record(header);
    for k in 0..frf.len() {
        let _ = writer.write_record(row(frf, k));
    }
    String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
}

fn row(frf: &Frf, k: usize) -> [String; COLUMNS] {
    let [frequency, magnitude, phase_deg, rest @ ..] = numbers(frf, k);
    let [coherence, magnitude_sigma, phase_sigma_deg, resolution] = rest;
    [
        frequency.to_string(),
        format!("{magnitude:e}"),
        phase_deg.to_string(),
        coherence.to_string(),
        format!("{magnitude_sigma:e}"),
        phase_sigma_deg.to_string(),
        resolution.to_string(),
    ]
}

/// The numbers of the columns of [`HEADER`] at a frequency.
pub fn numbers(frf: &Frf, k: usize) -> [f64; COLUMNS] {
    [
        frf.frequency_hz[k],
        frf.response[k].norm(),
        frf.phase_rad(k).to_degrees(),
        frf.coherence[k],
        frf.magnitude_sigma[k],
        frf.phase_sigma_rad[k].to_degrees(),
        frf.resolution_hz[k],
    ]
}

/// Reads an FRF in metres per ampere from a file.
///
/// # Errors
/// When the file cannot be read, or is not such an FRF.
pub fn read(path: &Path) -> Result<Frf, FrfCsvError> {
    let text = input_file::read_text(path, MAX_TABLE_BYTES)
        .map_err(|source| FrfCsvError::File(path.to_owned(), source))?;
    from_str(&text)
}

/// Reads an FRF in metres per ampere from text.
///
/// # Errors
/// When the header differs from [`HEADER`], or a row is not seven finite numbers with rising frequencies above 0, no negative
/// magnitude, standard deviations above 0 and a coherence of 0 to 1.
pub fn from_str(text: &str) -> Result<Frf, FrfCsvError> {
    check_unit(text)?;
    let mut reader = csv::ReaderBuilder::new()
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes());
    let mut frf = Frf::default();
    for record in reader.records() {
        let record = record.map_err(|error| not_a_table(&error))?;
        let numbers = finite_numbers(&record)?;
        push_row(numbers, &mut frf).ok_or_else(|| invalid_row(&record))?;
        check_values(&record, numbers)?;
    }
    Ok(frf)
}

/// Whether the first line has the columns of [`HEADER`], the magnitude in any unit.
pub fn has_own_columns(text: &str) -> bool {
    let found = text.lines().next().unwrap_or_default().trim();
    !matches!(wrong_header(found), FrfCsvError::Header { .. })
}

/// Checks that a text with the columns of [`HEADER`] has the magnitude in metres per ampere.
///
/// # Errors
/// When it has another unit.
pub fn check_unit(text: &str) -> Result<(), FrfCsvError> {
    let found = text.lines().next().unwrap_or_default().trim();
    if found == HEADER {
        Ok(())
    } else {
        Err(wrong_header(found))
    }
}

/// The columns are those of another file, or of a response in another unit.
fn wrong_header(found: &str) -> FrfCsvError {
    let name = found.split(',').nth(1).unwrap_or_default();
    if found.replacen(name, METRES_PER_AMPERE, 1) == HEADER {
        FrfCsvError::Unit { name: name.into() }
    } else {
        FrfCsvError::Header {
            found: found.into(),
        }
    }
}

fn not_a_table(error: &csv::Error) -> FrfCsvError {
    FrfCsvError::Table {
        reason: error.to_string(),
    }
}

fn invalid_row(record: &csv::StringRecord) -> FrfCsvError {
    FrfCsvError::Row {
        line: line(record),
        text: text(record),
    }
}

fn line(record: &csv::StringRecord) -> u64 {
    record.position().map_or(0, csv::Position::line)
}

fn text(record: &csv::StringRecord) -> String {
    record.iter().collect::<Vec<_>>().join(",")
}

/// The numbers of a row, if there is one for each column and all are finite.
fn finite_numbers(record: &csv::StringRecord) -> Result<[f64; COLUMNS], FrfCsvError> {
    let cells = record.iter().zip(HEADER.split(','));
    let numbers = cells.map(|(cell, column)| {
        let number = cell.parse().ok().filter(|number: &f64| number.is_finite());
        number.ok_or_else(|| FrfCsvError::Cell {
            line: line(record),
            column,
            text: cell.into(),
            row: text(record),
        })
    });
    let numbers: Vec<f64> = numbers.collect::<Result<_, _>>()?;
    let count_is_right = record.len() == COLUMNS;
    let numbers = numbers.try_into().ok().filter(|_| count_is_right);
    numbers.ok_or_else(|| invalid_row(record))
}

/// Refuses a magnitude, a standard deviation or a coherence that no measurement has.
fn check_values(record: &csv::StringRecord, numbers: [f64; COLUMNS]) -> Result<(), FrfCsvError> {
    let [
        _,
        magnitude,
        _,
        coherence,
        magnitude_sigma,
        phase_sigma_deg,
        _,
    ] = numbers;
    let magnitude_defect = (magnitude < 0.0).then_some(ValueDefect::NegativeMagnitude);
    let found = [
        (METRES_PER_AMPERE, magnitude, magnitude_defect),
        ("coherence", coherence, coherence_defect(coherence)),
        (
            MAGNITUDE_SIGMA,
            magnitude_sigma,
            sigma_defect(magnitude_sigma),
        ),
        (
            "phase_sigma_deg",
            phase_sigma_deg,
            sigma_defect(phase_sigma_deg),
        ),
    ];
    let mut defects = found
        .into_iter()
        .filter_map(|(column, value, defect)| Some((column, value, defect?)));
    defects.next().map_or(Ok(()), |(column, value, defect)| {
        Err(FrfCsvError::Value {
            line: line(record),
            column,
            value,
            defect,
        })
    })
}

/// Appends a row; `None` if its frequency is not above the one before, or not above 0.
fn push_row(numbers: [f64; COLUMNS], frf: &mut Frf) -> Option<()> {
    let [frequency, magnitude, phase_deg, rest @ ..] = numbers;
    let [coherence, magnitude_sigma, phase_sigma_deg, resolution] = rest;
    let last = frf.frequency_hz.last().copied().unwrap_or(0.0);
    if frequency <= last {
        return None;
    }
    let response = Complex::from_polar(magnitude, phase_deg.to_radians());
    frf.frequency_hz.push(frequency);
    frf.response.push(response);
    frf.coherence.push(coherence.clamp(0.0, 1.0));
    frf.magnitude_sigma.push(magnitude_sigma);
    frf.phase_sigma_rad.push(phase_sigma_deg.to_radians());
    frf.resolution_hz.push(resolution);
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn error_of_another_unit_holds_the_name_of_the_column() {
        let text = HEADER.replace(METRES_PER_AMPERE, "magnitude_a_per_m");
        let error = from_str(&text).expect_err("another unit");
        assert!(
            matches!(&error, FrfCsvError::Unit { name } if name == "magnitude_a_per_m"),
            "{error:?}"
        );
    }

    #[test]
    fn error_of_a_row_holds_its_line_and_text() {
        let text = format!("{HEADER}\n0.5,1e-4,0,1,1e-7,0.1,0.1\n1,2,3\n");
        let error = from_str(&text).expect_err("a row of three numbers");
        assert!(
            matches!(&error, FrfCsvError::Row { line: 3, text } if text == "1,2,3"),
            "{error:?}"
        );
    }

    #[test]
    fn rejects_sigma_and_coherence_that_no_measurement_has_with_line_column_and_value() {
        use ValueDefect::{Coherence, NegativeMagnitude, NegativeSigma, ZeroSigma};
        for (row, at, of, is) in [
            (
                "1,-2,3,1,1,1,0.1",
                "magnitude_m_per_a",
                -2.0,
                NegativeMagnitude,
            ),
            ("1,2,3,1,0,1,0.1", "magnitude_sigma", 0.0, ZeroSigma),
            ("1,2,3,1,-0.5,1,0.1", "magnitude_sigma", -0.5, NegativeSigma),
            ("1,2,3,1,1,0,0.1", "phase_sigma_deg", 0.0, ZeroSigma),
            ("1,2,3,1,1,-2,0.1", "phase_sigma_deg", -2.0, NegativeSigma),
            ("1,2,3,1.7,1,1,0.1", "coherence", 1.7, Coherence),
            ("1,2,3,-0.1,1,1,0.1", "coherence", -0.1, Coherence),
        ] {
            let error = from_str(&format!("{HEADER}\n{row}\n")).expect_err(row);
            let FrfCsvError::Value {
                line: 2,
                column,
                value,
                defect,
            } = error
            else {
                panic!("{row}: {error:?}");
            };
            assert_eq!((column, value, defect), (at, of, is), "{row}");
        }
    }

    #[test]
    fn error_of_a_sigma_that_is_not_finite_holds_line_column_and_text() {
        let error = from_str(&format!("{HEADER}\n1,2,3,1,inf,1,0.1\n")).expect_err("infinite");
        assert!(
            matches!(&error, FrfCsvError::Cell { line: 2, column: "magnitude_sigma", text, .. } if text == "inf"),
            "{error:?}"
        );
    }

    #[test]
    fn rejects_frequencies_that_are_not_above_0() {
        for frequency in ["0", "-1"] {
            let error = from_str(&format!("{HEADER}\n{frequency},2,3,1,1,1,0.1\n"));
            assert!(
                matches!(error, Err(FrfCsvError::Row { line: 2, .. })),
                "{frequency}: {error:?}"
            );
        }
    }

    #[test]
    fn coherence_above_one_by_rounding_is_one() {
        let frf = from_str(&format!("{HEADER}\n1,2,3,1.0000005,1,1,0.1\n")).expect("rounded");
        assert_eq!(frf.coherence, [1.0]);
    }
}
