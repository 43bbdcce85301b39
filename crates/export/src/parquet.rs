//! Doubles for quantities, null where there is no measurement; unsigned 64-bit integers for counts. Not compressed.

use std::io;
use std::path::Path;
use std::sync::Arc;

use ::parquet::basic::{ConvertedType, Repetition, Type as PhysicalType};
use ::parquet::data_type::{DoubleType, Int64Type};
use ::parquet::errors::{ParquetError, Result};
use ::parquet::file::writer::{SerializedColumnWriter, SerializedFileWriter};
use ::parquet::schema::types::{Type, TypePtr};

use super::file::Output;
use super::rows::{self, Rows};
use super::{ExportError, SIGNALS, Signal, Value};
use bench_identify::{Frf, frf_csv};
use bench_recording::Recording;
use bench_rt::record::TickRecord;

/// Number of rows in a row group, which is in memory while it is written: 17 columns of 8 bytes each are 9 MB.
const GROUP: usize = 1 << 16;

pub(super) fn signals(
    recording: &Path,
    out: &mut Output,
) -> std::result::Result<Recording, ExportError> {
    let schema = signals_schema().map_err(failed)?;
    let file = SerializedFileWriter::new(out, schema, Arc::default()).map_err(failed)?;
    let mut groups = Groups {
        file,
        rows: Vec::with_capacity(GROUP),
    };
    let recording = rows::open(recording, &mut groups)?;
    groups.write_group().map_err(failed)?;
    groups.file.close().map_err(failed)?;
    Ok(recording)
}

/// The columns of the table of `bench identify`.
pub(super) fn response(frf: &Frf, out: &mut Output) -> std::result::Result<(), ExportError> {
    write_response(frf, out).map_err(failed)
}

fn write_response(frf: &Frf, out: &mut Output) -> Result<()> {
    let fields = frf_csv::HEADER.split(',').map(required_double);
    let schema = table("response", fields.collect::<Result<_>>()?)?;
    let mut file = SerializedFileWriter::new(out, schema, Arc::default())?;
    let rows: Vec<_> = (0..frf.len()).map(|k| frf_csv::numbers(frf, k)).collect();
    let mut group = file.next_row_group()?;
    for column in 0..frf_csv::COLUMNS {
        let numbers: Vec<f64> = rows.iter().map(|row| row[column]).collect();
        if let Some(mut writer) = group.next_column()? {
            let column = writer.typed::<DoubleType>();
            column.write_batch(&numbers, None, None)?;
            writer.close()?;
        }
    }
    group.close()?;
    file.close().map(drop)
}

/// Writes the ticks in groups.
struct Groups<'a> {
    file: SerializedFileWriter<&'a mut Output>,
    rows: Vec<TickRecord>,
}

impl Rows for Groups<'_> {
    fn push(&mut self, record: &TickRecord) -> std::result::Result<(), ExportError> {
        self.rows.push(*record);
        if self.rows.len() < GROUP {
            Ok(())
        } else {
            self.write_group().map_err(failed)
        }
    }
}

impl Groups<'_> {
    /// Writes the ticks that are not in a group.
    fn write_group(&mut self) -> Result<()> {
        if self.rows.is_empty() {
            return Ok(());
        }
        let mut group = self.file.next_row_group()?;
        for signal in &SIGNALS {
            if let Some(writer) = group.next_column()? {
                write_column(writer, signal, &self.rows)?;
            }
        }
        group.close()?;
        self.rows.clear();
        Ok(())
    }
}

/// The error of the operating system, if it is the reason, so that its remedy is stated.
fn failed(error: ParquetError) -> ExportError {
    let error = match error {
        ParquetError::External(source) => match source.downcast::<io::Error>() {
            Ok(error) => *error,
            Err(source) => io::Error::other(source),
        },
        error => io::Error::other(error),
    };
    error.into()
}

fn signals_schema() -> Result<TypePtr> {
    let fields = SIGNALS.iter().map(field).collect::<Result<_>>()?;
    table("signals", fields)
}

fn table(name: &str, fields: Vec<TypePtr>) -> Result<TypePtr> {
    let table = Type::group_type_builder(name).with_fields(fields);
    Ok(Arc::new(table.build()?))
}

fn field(signal: &Signal) -> Result<TypePtr> {
    let field = match signal.value {
        Value::Real(..) => Type::primitive_type_builder(signal.name, PhysicalType::DOUBLE)
            .with_repetition(Repetition::OPTIONAL),
        Value::Count(_) => Type::primitive_type_builder(signal.name, PhysicalType::INT64)
            .with_converted_type(ConvertedType::UINT_64)
            .with_repetition(Repetition::REQUIRED),
    };
    Ok(Arc::new(field.build()?))
}

fn required_double(name: &str) -> Result<TypePtr> {
    let field = Type::primitive_type_builder(name, PhysicalType::DOUBLE);
    let field = field.with_repetition(Repetition::REQUIRED);
    Ok(Arc::new(field.build()?))
}

fn write_column(
    mut writer: SerializedColumnWriter<'_>,
    signal: &Signal,
    rows: &[TickRecord],
) -> Result<()> {
    match signal.value {
        Value::Real(_, value) => {
            let values = rows.iter().map(value);
            let levels: Vec<i16> = values.clone().map(|v| i16::from(v.is_some())).collect();
            let values: Vec<f64> = values.flatten().collect();
            let column = writer.typed::<DoubleType>();
            column.write_batch(&values, Some(&levels), None)?;
        }
        Value::Count(value) => {
            // The 64 bits of Parquet's integer, which the schema declares unsigned.
            let bits: Vec<i64> = rows.iter().map(|row| value(row).cast_signed()).collect();
            let column = writer.typed::<Int64Type>();
            column.write_batch(&bits, None, None)?;
        }
    }
    writer.close()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn states_that_the_disk_is_full() {
        let full = io::Error::from(io::ErrorKind::StorageFull);
        let error = failed(ParquetError::from(full)).at(Path::new("run.parquet"));
        assert!(error.to_string().contains("free some space"), "{error}");
        let other = failed(ParquetError::EOF("no more bytes".into()));
        assert!(other.to_string().contains("no more bytes"), "{other}");
    }
}
