//! Universal files: dataset 58, functions at nodal degrees of freedom, as text, and 58b, with binary data (SDRC I-DEAS, *Test Universal
//! File Datasets*). Other datasets are skipped.
//!
//! ```text
//!     -1
//!     58          or 58b with byte order, format and number of bytes
//! 5 ID lines, function and nodes, form of the data, 4 axes
//! data
//!     -1
//! ```

mod data;
mod dataset;
mod header;
mod names;

use crate::budget::Budget;
use crate::bytes::{ByteOrder, Bytes};
use crate::error::ArraysError;

pub use dataset::{Dataset, Function};
pub(crate) use names::records;

use dataset::is_delimiter;

/// Whether a file begins with the line before a dataset.
pub(crate) fn is_one(bytes: &[u8]) -> bool {
    let mut bytes = Bytes::new(bytes, ByteOrder::Little);
    bytes.line().is_some_and(is_delimiter)
}

/// The datasets 58 and 58b of a file.
pub(crate) fn datasets(bytes: &[u8], budget: &mut Budget) -> Result<Vec<Dataset>, ArraysError> {
    let mut file = Bytes::new(bytes, ByteOrder::Little);
    let mut datasets = Vec::new();
    while let Some(line) = file.line() {
        if !is_delimiter(line) {
            continue;
        }
        match first_line(&mut file).and_then(header::form) {
            Some(form) => datasets.push(dataset(&mut file, form, budget)?),
            None => skip(&mut file),
        }
    }
    Ok(datasets)
}

/// The line behind the line -1 that begins a dataset. A second one is a dataset without content, as pyuff leaves behind.
fn first_line<'a>(file: &mut Bytes<'a>) -> Option<&'a [u8]> {
    loop {
        let line = file.line()?;
        if !is_delimiter(line) {
            return Some(line);
        }
    }
}

/// Skips to the end of another dataset.
fn skip(file: &mut Bytes<'_>) {
    while file.line().is_some_and(|line| !is_delimiter(line)) {}
}

fn dataset(
    file: &mut Bytes<'_>,
    form: header::Form,
    budget: &mut Budget,
) -> Result<Dataset, ArraysError> {
    let header = header::Header::read(file)?;
    let in_dataset = |error: ArraysError| match header.id.as_str() {
        "" => error.in_variable(&header.place),
        id => error.in_variable(id),
    };
    let data = data::read(file, form, &header, budget).map_err(in_dataset)?;
    Ok(Dataset {
        function: header.function,
        id: header.id,
        place: header.place,
        abscissas: data.abscissas,
        abscissa_unit: header.abscissa_unit,
        ordinates: data.ordinates,
        unit: header.unit,
        denominator_unit: header.denominator_unit,
    })
}

#[cfg(test)]
mod tests;
