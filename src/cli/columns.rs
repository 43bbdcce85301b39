//! Tables of columns whose names contain the unit, written as CSV, and as Parquet if the program is built with that feature.

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
    /// Refuses a format that this program is built without, before anything is computed.
    pub fn check(&self) -> Result<(), CliError> {
        match self.parquet {
            Some(_) if !cfg!(feature = "parquet") => Err(CliError::Usage(
                "--parquet is not available, because this `bench` was built without Parquet; build it with `--features parquet`, or use --csv FILE".into(),
            )),
            _ => Ok(()),
        }
    }

    /// Writes the requested files and replaces existing ones. Without a file, the columns are not computed.
    pub fn write(&self, columns: impl FnOnce() -> Vec<Column>) -> Result<(), CliError> {
        if self.csv.is_none() && self.parquet.is_none() {
            return Ok(());
        }
        let columns = columns();
        if let Some(path) = &self.csv {
            write_csv(path, &columns).map_err(|e| cannot_write(path, &e))?;
        }
        match &self.parquet {
            #[cfg(feature = "parquet")]
            Some(path) => parquet::write(path, &columns).map_err(|e| cannot_write(path, &e)),
            _ => self.check(),
        }
    }

    /// The CSV file.
    pub fn csv(&self) -> Option<String> {
        self.csv.as_ref().map(|path| path.display().to_string())
    }

    /// The files that `what` is in, as a line; empty without a file.
    pub fn files_text(&self, what: &str) -> String {
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
    /// The name, which ends with the unit.
    pub name: String,
    /// The numbers, equally many in each column of a table.
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

    /// Columns of quantities, from rows.
    pub fn of_rows(
        names: impl IntoIterator<Item = String>,
        rows: impl Iterator<Item = Vec<f64>>,
    ) -> Vec<Column> {
        let rows: Vec<Vec<f64>> = rows.collect();
        let names = names.into_iter().enumerate();
        let columns = names.map(|(index, name)| {
            let numbers = rows.iter().filter_map(|row| row.get(index)).copied();
            Column::real(name, numbers.collect())
        });
        columns.collect()
    }

    fn len(&self) -> usize {
        match &self.numbers {
            Numbers::Real(numbers) => numbers.len(),
            Numbers::Count(numbers) => numbers.len(),
        }
    }

    /// The shortest text of the same number: `inf` for infinity, empty for a missing one.
    fn cell(&self, row: usize) -> String {
        match &self.numbers {
            Numbers::Real(numbers) => format!("{:e}", numbers[row]),
            Numbers::Count(numbers) => {
                numbers[row].map_or(String::new(), |number| number.to_string())
            }
        }
    }
}

/// A header line, and a line for each row.
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

pub(super) fn cannot_write(path: &Path, error: &impl std::fmt::Display) -> CliError {
    CliError::Failed(format!(
        "cannot write {}: {error}; free some space, or choose another file",
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

    /// Number of rows in a row group, which a reader loads as a whole.
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
                let numbers = &numbers[rows];
                let levels = numbers.iter().map(|number| i16::from(number.is_some()));
                let levels: Vec<i16> = levels.collect();
                let values = numbers.iter().flatten().map(|&number| number as i64);
                let values: Vec<i64> = values.collect();
                let column = writer.typed::<Int64Type>();
                column.write_batch(&values, Some(&levels), None)?;
            }
        }
        writer.close()
    }
}
