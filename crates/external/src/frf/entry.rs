//! A number of a column of a response.

use std::path::Path;

use crate::error::{DataError, Place};

/// A number with its place.
pub(super) struct Entry<'a> {
    pub column: &'a str,
    pub place: Place,
    /// As it is written; empty for an empty cell.
    pub text: String,
    /// `None` unless it is a finite number.
    pub number: Option<f64>,
}

impl Entry<'_> {
    /// The number.
    ///
    /// # Errors
    /// When it is not a finite number.
    pub fn finite(&self, path: &Path) -> Result<f64, DataError> {
        self.number.ok_or_else(|| DataError::Cell {
            path: path.to_owned(),
            place: self.place,
            column: self.column.into(),
            text: self.text.clone(),
        })
    }
}
