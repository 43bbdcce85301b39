//! Doubles for quantities, null where there is no measurement; unsigned 64-bit integers for counts. Not compressed.

use std::sync::Arc;

use ::parquet::basic::{ConvertedType, Repetition, Type as PhysicalType};
use ::parquet::data_type::{DoubleType, Int64Type};
use ::parquet::errors::{ParquetError, Result};
use ::parquet::file::writer::SerializedFileWriter;
use ::parquet::schema::types::{Type, TypePtr};

use super::file::Output;
use super::{ExportError, SIGNALS, Sample, Signal};
use crate::recording::Recording;
use crate::rt::record::TickRecord;

/// Number of rows in a row group, which is in memory while it is written: 16 columns of 8 bytes each are 8 MB.
const GROUP: usize = 1 << 16;

pub(super) fn write(
    recording: &Recording,
    out: &mut Output,
) -> std::result::Result<(), ExportError> {
    let mut file = SerializedFileWriter::new(out, schema().map_err(failed)?, Arc::default())
        .map_err(failed)?;
    let mut rows = Vec::with_capacity(GROUP);
    for record in recording.ticks()? {
        rows.push(record?);
        if rows.len() == GROUP {
            write_group(&mut file, &rows).map_err(failed)?;
            rows.clear();
        }
    }
    if !rows.is_empty() {
        write_group(&mut file, &rows).map_err(failed)?;
    }
    file.close().map(drop).map_err(failed)
}

fn failed(error: ParquetError) -> ExportError {
    std::io::Error::other(error).into()
}

fn schema() -> Result<TypePtr> {
    let fields = SIGNALS.iter().map(field).collect::<Result<_>>()?;
    let table = Type::group_type_builder("signals").with_fields(fields);
    Ok(Arc::new(table.build()?))
}

fn field(signal: &Signal) -> Result<TypePtr> {
    let field = match signal.is_count() {
        true => Type::primitive_type_builder(signal.name, PhysicalType::INT64)
            .with_converted_type(ConvertedType::UINT_64)
            .with_repetition(Repetition::REQUIRED),
        false => Type::primitive_type_builder(signal.name, PhysicalType::DOUBLE)
            .with_repetition(Repetition::OPTIONAL),
    };
    Ok(Arc::new(field.build()?))
}

fn write_group(file: &mut SerializedFileWriter<&mut Output>, rows: &[TickRecord]) -> Result<()> {
    let mut group = file.next_row_group()?;
    for signal in &SIGNALS {
        let Some(mut writer) = group.next_column()? else {
            break;
        };
        let samples = rows.iter().map(signal.value);
        if signal.is_count() {
            let counts: Vec<i64> = samples.map(bits).collect();
            writer
                .typed::<Int64Type>()
                .write_batch(&counts, None, None)?;
        } else {
            let values: Vec<Option<f64>> = samples.map(quantity).collect();
            let levels: Vec<i16> = values.iter().map(|v| i16::from(v.is_some())).collect();
            let values: Vec<f64> = values.into_iter().flatten().collect();
            let column = writer.typed::<DoubleType>();
            column.write_batch(&values, Some(&levels), None)?;
        }
        writer.close()?;
    }
    group.close().map(drop)
}

fn quantity(sample: Sample) -> Option<f64> {
    match sample {
        Sample::Real(value) => value,
        Sample::Count(count) => Some(count as f64),
    }
}

/// A count in the 64 bits of Parquet's integer, which the schema declares unsigned.
fn bits(sample: Sample) -> i64 {
    match sample {
        Sample::Real(_) => 0,
        Sample::Count(count) => count.cast_signed(),
    }
}
