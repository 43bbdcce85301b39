//! Tables out: columns with a name and a unit in it, as CSV, and as Parquet where the program is built with that feature.

use std::io::Write;
use std::path::{Path, PathBuf};

use super::error::CliError;

/// Where a command writes its table.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct TableOptions {
    /// Write the table to this file as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Write the table to this file as Parquet, if built with `--features parquet`
    #[arg(long, value_name = "FILE")]
    parquet: Option<PathBuf>,
}

impl TableOptions {
    /// Refuses what this program was not built for, before anything is computed.
    pub fn check(&self) -> Result<(), CliError> {
        match self.parquet {
            Some(_) if !cfg!(feature = "parquet") => Err(CliError::Usage(
                "this `bench` was built without Parquet: build it with `--features parquet`, or take --csv FILE".into(),
            )),
            _ => Ok(()),
        }
    }

    /// Writes the files that are asked for, over whatever was there; the columns are made only then.
    pub fn write(&self, columns: impl FnOnce() -> Vec<Column>) -> Result<(), CliError> {
        if self.csv.is_none() && self.parquet.is_none() {
            return Ok(());
        }
        let columns = columns();
        if let Some(path) = &self.csv {
            write_csv(path, &columns).map_err(|e| failed(path, &e))?;
        }
        match &self.parquet {
            #[cfg(feature = "parquet")]
            Some(path) => parquet::write(path, &columns).map_err(|e| failed(path, &e)),
            _ => self.check(),
        }
    }

    /// The CSV file.
    pub fn csv(&self) -> Option<String> {
        self.csv.as_ref().map(|path| path.display().to_string())
    }

    /// A line that says where `what` is; nothing without a file.
    pub fn told(&self, what: &str) -> String {
        let files: Vec<String> = [&self.csv, &self.parquet]
            .into_iter()
            .flatten()
            .map(|path| path.display().to_string())
            .collect();
        if files.is_empty() {
            String::new()
        } else {
            format!("{what} in {}\n", files.join(" and "))
        }
    }
}

/// A column.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Column {
    /// Its name, which ends in the unit.
    pub name: String,
    /// Its numbers, as many as in every other column of the table.
    pub numbers: Numbers,
}

/// The numbers of a column.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Numbers {
    /// Quantities.
    Real(Vec<f64>),
    /// Counts; some may be missing.
    Count(Vec<Option<u64>>),
}

impl Column {
    pub fn real(name: impl Into<String>, numbers: Vec<f64>) -> Column {
        Column {
            name: name.into(),
            numbers: Numbers::Real(numbers),
        }
    }

    pub fn count(
        name: impl Into<String>,
        numbers: impl IntoIterator<Item = Option<u64>>,
    ) -> Column {
        Column {
            name: name.into(),
            numbers: Numbers::Count(numbers.into_iter().collect()),
        }
    }

    /// Columns of quantities from rows of as many.
    pub fn of_rows(
        names: impl IntoIterator<Item = String>,
        rows: impl Iterator<Item = Vec<f64>>,
    ) -> Vec<Column> {
        let mut columns: Vec<(String, Vec<f64>)> =
            names.into_iter().map(|name| (name, Vec::new())).collect();
        for row in rows {
            columns
                .iter_mut()
                .zip(row)
                .for_each(|((_, numbers), number)| numbers.push(number));
        }
        columns
            .into_iter()
            .map(|(name, numbers)| Column::real(name, numbers))
            .collect()
    }

    fn len(&self) -> usize {
        match &self.numbers {
            Numbers::Real(numbers) => numbers.len(),
            Numbers::Count(numbers) => numbers.len(),
        }
    }

    /// The shortest text that reads as the same number; `inf` at infinity, nothing of what is missing.
    fn cell(&self, row: usize) -> String {
        match &self.numbers {
            Numbers::Real(numbers) => format!("{:e}", numbers[row]),
            Numbers::Count(numbers) => {
                numbers[row].map_or(String::new(), |number| number.to_string())
            }
        }
    }
}

/// A header, then a row a line.
fn write_csv(path: &Path, columns: &[Column]) -> std::io::Result<()> {
    let mut file = std::io::BufWriter::new(std::fs::File::create(path)?);
    let names: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    writeln!(file, "{}", names.join(","))?;
    for row in 0..columns.first().map_or(0, Column::len) {
        let cells: Vec<String> = columns.iter().map(|column| column.cell(row)).collect();
        writeln!(file, "{}", cells.join(","))?;
    }
    file.flush()
}

fn failed(path: &Path, error: &impl std::fmt::Display) -> CliError {
    CliError::Failed(format!(
        "cannot write {}: {error}; free some space or choose another file",
        path.display()
    ))
}

#[cfg(feature = "parquet")]
mod parquet {
    //! Doubles for quantities, 64-bit integers or null for counts; not compressed.

    use std::fs::File;
    use std::path::Path;
    use std::sync::Arc;

    use parquet::basic::{Repetition, Type as PhysicalType};
    use parquet::data_type::{DoubleType, Int64Type};
    use parquet::errors::Result;
    use parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
    use parquet::schema::types::{Type, TypePtr};

    use super::{Column, Numbers};

    /// Rows of a group, which a reader takes at a time.
    const GROUP: usize = 1 << 20;

    pub fn write(path: &Path, columns: &[Column]) -> Result<()> {
        let fields = columns.iter().map(field).collect::<Result<_>>()?;
        let schema = Arc::new(
            Type::group_type_builder("table")
                .with_fields(fields)
                .build()?,
        );
        let mut file = SerializedFileWriter::new(File::create(path)?, schema, Arc::default())?;
        let rows = columns.first().map_or(0, Column::len);
        for first in (0..rows).step_by(GROUP) {
            let mut group = file.next_row_group()?;
            for column in columns {
                if let Some(writer) = group.next_column()? {
                    write_column(writer, column, first..rows.min(first + GROUP))?;
                }
            }
            group.close()?;
        }
        file.close().map(drop)
    }

    fn field(column: &Column) -> Result<TypePtr> {
        let (kind, repetition) = match column.numbers {
            Numbers::Real(_) => (PhysicalType::DOUBLE, Repetition::REQUIRED),
            Numbers::Count(_) => (PhysicalType::INT64, Repetition::OPTIONAL),
        };
        Ok(Arc::new(
            Type::primitive_type_builder(&column.name, kind)
                .with_repetition(repetition)
                .build()?,
        ))
    }

    fn write_column(
        mut writer: SerializedColumnWriter,
        column: &Column,
        rows: std::ops::Range<usize>,
    ) -> Result<()> {
        match &column.numbers {
            Numbers::Real(numbers) => {
                writer
                    .typed::<DoubleType>()
                    .write_batch(&numbers[rows], None, None)?;
            }
            Numbers::Count(numbers) => {
                let there: Vec<i16> = numbers[rows.clone()]
                    .iter()
                    .map(|number| i16::from(number.is_some()))
                    .collect();
                let numbers: Vec<i64> = numbers[rows]
                    .iter()
                    .flatten()
                    .map(|&number| number as i64)
                    .collect();
                writer
                    .typed::<Int64Type>()
                    .write_batch(&numbers, Some(&there), None)?;
            }
        }
        writer.close()
    }
}
