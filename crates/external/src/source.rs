//! Where the columns of a record come from: a table of text, or arrays.

use std::path::Path;

use super::array_table::ArrayTable;
use super::content::Content;
use super::error::ExternalCsvError;
use super::open;
use super::table::Table;
use super::times::{TimeUnit, Times};

/// A file with columns.
pub(crate) enum Source<'a> {
    Text(Table<'a>),
    Arrays(ArrayTable<'a>),
}

impl<'a> Source<'a> {
    pub fn open(path: &'a Path) -> Result<Source<'a>, ExternalCsvError> {
        match open::content(path)? {
            Content::Text(text) => Table::of(path, text).map(Source::Text),
            Content::Arrays(format, bytes) => {
                ArrayTable::of(path, format, &bytes).map(Source::Arrays)
            }
        }
    }

    /// Names of the columns.
    pub fn names(&self) -> Vec<String> {
        match self {
            Source::Text(table) => table.names().to_vec(),
            Source::Arrays(table) => table.names(),
        }
    }

    /// Single numbers with their names.
    pub fn scalars(&self) -> &[(String, f64)] {
        match self {
            Source::Text(_) => &[],
            Source::Arrays(table) => table.scalars(),
        }
    }

    /// The numbers of some columns.
    pub fn numbers<const N: usize>(
        &self,
        names: [&String; N],
    ) -> Result<[Vec<f64>; N], ExternalCsvError> {
        match self {
            Source::Text(table) => table.numbers(names),
            Source::Arrays(table) => table.numbers(names),
        }
    }

    /// The numbers of some columns, and the times of another one.
    pub fn numbers_and_times<const N: usize>(
        &self,
        names: [&String; N],
        time: &String,
        unit: Option<TimeUnit>,
    ) -> Result<([Vec<f64>; N], Times), ExternalCsvError> {
        match self {
            Source::Text(table) => table.numbers_and_times(names, time, unit),
            Source::Arrays(table) => table.numbers_and_times(names, time, unit),
        }
    }
}
