//! Parquet files, read by the crate `parquet`: tables whose columns are stored apart.
//!
//! Columns of numbers, and of times with their unit, are read. A missing number is NaN. Lists, texts, decimal numbers, and columns that
//! cannot be read, are named only.

use ::parquet::basic::{ConvertedType, Encoding, LogicalType, TimeUnit};
use ::parquet::column::page::PageReader;
use ::parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use ::parquet::data_type::DataType;
use ::parquet::errors::ParquetError;
use ::parquet::file::metadata::ColumnChunkMetaData;
use ::parquet::file::reader::{FileReader, SerializedFileReader};
use ::parquet::schema::types::ColumnDescriptor;
use bytes::Bytes;

use crate::budget::Budget;
use crate::error::ArraysError;
use crate::number::{Numbers, Precision};
use crate::value::{MAX_NAME_BYTES, NumericArray, Value, Variables, printable};

const MARK: &[u8] = b"PAR1";
/// Most columns of a table.
const MAX_COLUMNS: usize = 4096;

/// Whether it is a Parquet file.
pub(crate) fn is_one(bytes: &[u8]) -> bool {
    bytes.starts_with(MARK)
}

/// The columns of a table.
pub(crate) fn variables(bytes: &[u8], budget: &mut Budget) -> Result<Variables, ArraysError> {
    let file = SerializedFileReader::new(Bytes::copy_from_slice(bytes)).map_err(unreadable)?;
    let schema = file.metadata().file_metadata().schema_descr();
    if schema.num_columns() > MAX_COLUMNS {
        return Err(damaged(&format!("more than {MAX_COLUMNS} columns")));
    }
    let mut variables = Variables::new();
    for index in 0..schema.num_columns() {
        let description = schema.column(index);
        let name = printable(description.path().string().as_bytes());
        if name.len() > MAX_NAME_BYTES {
            continue;
        }
        budget.take(0, 0)?;
        let value = match what_is_not_read(&description) {
            Some(what) => Value::Other(what.into()),
            None => match column(&file, bytes.len(), index, budget) {
                Err(ArraysError::Parquet { reason }) => {
                    Value::Other(format!("a column that cannot be read: {reason}"))
                }
                result => result?,
            },
        };
        variables.push((name, value));
    }
    Ok(variables)
}

fn unreadable(error: ParquetError) -> ArraysError {
    ArraysError::Parquet {
        reason: printable(error.to_string().as_bytes()),
    }
}

fn damaged(reason: &str) -> ArraysError {
    ArraysError::Parquet {
        reason: reason.into(),
    }
}

/// What a column is that has no numbers.
fn what_is_not_read(description: &ColumnDescriptor) -> Option<&'static str> {
    let is_decimal = matches!(
        description.logical_type_ref(),
        Some(LogicalType::Decimal(_))
    ) || description.converted_type() == ConvertedType::DECIMAL;
    if description.max_rep_level() > 0 {
        Some("lists")
    } else if is_decimal {
        Some("decimal numbers")
    } else {
        None
    }
}

/// The numbers of all groups of rows of a column.
fn column(
    file: &SerializedFileReader<Bytes>,
    file_bytes: usize,
    index: usize,
    budget: &mut Budget,
) -> Result<Value, ArraysError> {
    let schema = file.metadata().file_metadata().schema_descr();
    let description = schema.column(index);
    let mut all: Option<Numbers> = None;
    for group in 0..file.num_row_groups() {
        let group = file.get_row_group(group).map_err(unreadable)?;
        let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(usize::MAX);
        budget.take(rows, 8)?;
        // The library panics at places that are negative, and at numbers of a dictionary without one.
        if !is_within(group.metadata().column(index), file_bytes) {
            return Err(damaged("a column beyond the end of the file"));
        }
        let pages = group.get_column_page_reader(index).map_err(unreadable)?;
        check_pages(pages, budget)?;
        let reader = group.get_column_reader(index).map_err(unreadable)?;
        let Some(numbers) = numbers(reader, rows, description.max_def_level())? else {
            return Ok(Value::Other("a column without numbers".into()));
        };
        all = Some(match all {
            Some(before) => joined(before, numbers),
            None => numbers,
        });
    }
    let numbers = all.unwrap_or(Numbers::Real(Vec::new(), Precision::Double));
    Ok(Value::Numbers(NumericArray {
        shape: vec![numbers.len()],
        numbers,
        unit: unit(&description),
    }))
}

/// Whether the pages of a column in a group of rows lie in the file.
fn is_within(column: &ColumnChunkMetaData, file_bytes: usize) -> bool {
    let data = column.data_page_offset();
    let start = column.dictionary_page_offset().unwrap_or(data);
    let places = [data, start, column.compressed_size()].map(u64::try_from);
    let [Ok(_), Ok(start), Ok(bytes)] = places else {
        return false;
    };
    let end = start.checked_add(bytes);
    end.is_some_and(|end| end <= file_bytes as u64)
}

/// Checks that the encodings of pages of numbers are those that are read, that the numbers of a dictionary stand behind it, and that all
/// pages together do not exceed the limit.
fn check_pages(mut pages: Box<dyn PageReader>, budget: &mut Budget) -> Result<(), ArraysError> {
    let mut has_dictionary = false;
    while let Some(page) = pages.get_next_page().map_err(unreadable)? {
        budget.take_unpacked(page.buffer().len() as u64)?;
        match page.encoding() {
            _ if !page.is_data_page() => has_dictionary = true,
            Encoding::RLE_DICTIONARY | Encoding::PLAIN_DICTIONARY if has_dictionary => {}
            Encoding::PLAIN | Encoding::RLE => {}
            Encoding::RLE_DICTIONARY | Encoding::PLAIN_DICTIONARY => {
                return Err(damaged("numbers of a dictionary without one"));
            }
            // The library panics at damaged pages of others, which writers use only if they are told to.
            other => return Err(damaged(&format!("the encoding {other}"))),
        }
    }
    Ok(())
}

/// The numbers of a group of rows; `None` of another type.
fn numbers(
    reader: ColumnReader,
    rows: usize,
    max_level: i16,
) -> Result<Option<Numbers>, ArraysError> {
    Ok(Some(match reader {
        ColumnReader::BoolColumnReader(reader) => {
            let values = values(reader, rows, max_level)?;
            integers(values, |value| i64::from(*value))
        }
        ColumnReader::Int32ColumnReader(reader) => {
            let values = values(reader, rows, max_level)?;
            integers(values, |value| i64::from(*value))
        }
        ColumnReader::Int64ColumnReader(reader) => {
            let values = values(reader, rows, max_level)?;
            integers(values, |value| *value)
        }
        ColumnReader::FloatColumnReader(reader) => {
            let values = values(reader, rows, max_level)?;
            reals(values, |value| f64::from(*value), Precision::Single)
        }
        ColumnReader::DoubleColumnReader(reader) => {
            let values = values(reader, rows, max_level)?;
            reals(values, |value| *value, Precision::Double)
        }
        _ => return Ok(None),
    }))
}

/// The values of a column in a group of rows; `None` where one is missing.
fn values<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    max_level: i16,
) -> Result<Vec<Option<T::T>>, ArraysError> {
    let (mut values, mut levels) = (Vec::new(), Vec::new());
    let mut read = 0;
    while read < rows {
        let left = rows - read;
        let (records, ..) = reader
            .read_records(left, Some(&mut levels), None, &mut values)
            .map_err(unreadable)?;
        if records == 0 {
            return Err(damaged(&format!("{read} of {rows} rows")));
        }
        read += records;
    }
    if max_level == 0 {
        return Ok(values.into_iter().map(Some).collect());
    }
    let mut values = values.into_iter();
    let of_level = |level: i16| {
        if level == max_level {
            values.next()
        } else {
            None
        }
    };
    Ok(levels.into_iter().map(of_level).collect())
}

/// Integers; with a missing one they are real numbers.
fn integers<T>(values: Vec<Option<T>>, convert: fn(&T) -> i64) -> Numbers {
    let all: Option<Vec<i64>> = values
        .iter()
        .map(|value| value.as_ref().map(convert))
        .collect();
    match all {
        Some(integers) => Numbers::Integer(integers),
        None => {
            let real = values.iter().map(|value| match value {
                Some(value) => convert(value) as f64,
                None => f64::NAN,
            });
            Numbers::Real(real.collect(), Precision::Double)
        }
    }
}

fn reals<T>(values: Vec<Option<T>>, convert: fn(&T) -> f64, precision: Precision) -> Numbers {
    let values = values.iter();
    let real = values.map(|value| value.as_ref().map_or(f64::NAN, convert));
    Numbers::Real(real.collect(), precision)
}

/// The numbers of two groups of rows; real, if one of them is.
fn joined(before: Numbers, after: Numbers) -> Numbers {
    match (before, after) {
        (Numbers::Integer(mut before), Numbers::Integer(after)) => {
            before.extend(after);
            Numbers::Integer(before)
        }
        (before, after) => {
            let precision = match (&before, &after) {
                (Numbers::Real(_, precision), _) | (_, Numbers::Real(_, precision)) => *precision,
                _ => Precision::Double,
            };
            let mut numbers = before.to_real().unwrap_or_default();
            numbers.extend(after.to_real().unwrap_or_default());
            Numbers::Real(numbers, precision)
        }
    }
}

/// The unit of a column of times.
fn unit(description: &ColumnDescriptor) -> Option<String> {
    let unit = match description.logical_type_ref()? {
        LogicalType::Timestamp(time) | LogicalType::Time(time) => time.unit,
        _ => return None,
    };
    let symbol = match unit {
        TimeUnit::MILLIS => "ms",
        TimeUnit::MICROS => "us",
        TimeUnit::NANOS => "ns",
    };
    Some(symbol.into())
}

#[cfg(test)]
mod tests;
