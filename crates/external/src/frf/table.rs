//! The columns of a response: those of a text, or those of arrays.

use std::path::Path;

use super::arrays::ArrayColumns;
use super::entry::Entry;
use super::error::FrfTableError;
use crate::content::Content;
use crate::error::{DataError, ExternalCsvError, Place};
use crate::open;
use crate::table::Table;

/// A file with the columns of a response.
pub(super) enum FrfTable<'a> {
    Text(Table<'a>),
    Arrays(ArrayColumns<'a>),
}

impl<'a> FrfTable<'a> {
    pub fn open(path: &'a Path) -> Result<FrfTable<'a>, FrfTableError> {
        match open::content(path)? {
            Content::Text(text) => Ok(FrfTable::Text(Table::of(path, text)?)),
            Content::Arrays(format, bytes) => {
                ArrayColumns::of(path, format, &bytes).map(FrfTable::Arrays)
            }
        }
    }

    pub fn path(&self) -> &'a Path {
        match self {
            FrfTable::Text(table) => table.path(),
            FrfTable::Arrays(arrays) => arrays.path,
        }
    }

    pub fn names(&self) -> &[String] {
        match self {
            FrfTable::Text(table) => table.names(),
            FrfTable::Arrays(arrays) => &arrays.names,
        }
    }

    /// Whether the file names its columns.
    pub fn has_names(&self) -> bool {
        match self {
            FrfTable::Text(table) => table.has_names(),
            FrfTable::Arrays(_) => true,
        }
    }

    /// The unit of a column; empty if the file does not state it.
    pub fn unit(&self, index: usize) -> &str {
        match self {
            FrfTable::Text(table) => table.unit(index),
            FrfTable::Arrays(arrays) => arrays.unit(index),
        }
    }

    /// Calls a function with the numbers of some columns at each frequency.
    pub fn each_row(
        &self,
        names: &[&String],
        mut take: impl FnMut(&[Entry<'_>]) -> Result<(), DataError>,
    ) -> Result<(), ExternalCsvError> {
        match self {
            FrfTable::Arrays(arrays) => arrays.each_row(names, take),
            FrfTable::Text(table) => table.each_row(names, |cells| {
                let entries = cells.iter().map(|cell| Entry {
                    column: cell.column,
                    place: Place::Line(cell.line),
                    text: cell.text.into(),
                    number: table.number(cell).ok(),
                });
                take(&entries.collect::<Vec<_>>())
            }),
        }
    }
}
