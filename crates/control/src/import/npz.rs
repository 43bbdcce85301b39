//! Archives of numpy (`numpy.savez`): a zip file with an array in each `.npy` file.

use std::io::{Cursor, Read};

use zip::ZipArchive;

use super::npy;
use super::value::{Value, Variables};
use crate::import_error::FormatError;

/// Largest array file in bytes: a matrix of order 64 of complex numbers, and its header.
const MAX_ARRAY_BYTES: u64 = 1 << 17;
/// Largest number of arrays in an archive.
const MAX_ARRAYS: usize = 64;

/// The arrays of an archive.
pub(super) fn variables(bytes: &[u8]) -> Result<Variables, FormatError> {
    let damaged = |_| FormatError::Damaged {
        at: 0,
        what: "the table of a zip file",
    };
    let mut archive = ZipArchive::new(Cursor::new(bytes)).map_err(damaged)?;
    if archive.len() > MAX_ARRAYS {
        return Err(FormatError::TooLarge {
            what: "the number of arrays",
            limit: MAX_ARRAYS,
            unit: "arrays",
        });
    }
    (0..archive.len())
        .map(|index| variable(&mut archive, index))
        .collect()
}

fn variable(
    archive: &mut ZipArchive<Cursor<&[u8]>>,
    index: usize,
) -> Result<(String, Value), FormatError> {
    let damaged = || FormatError::Damaged {
        at: 0,
        what: "an entry of a zip file",
    };
    let file = archive.by_index(index).map_err(|_| damaged())?;
    let name = file.name().map_err(|_| damaged())?;
    let name = name.trim_end_matches(".npy").to_string();
    let mut content = Vec::new();
    let mut limited = file.take(MAX_ARRAY_BYTES + 1);
    limited.read_to_end(&mut content).map_err(|_| damaged())?;
    if content.len() as u64 > MAX_ARRAY_BYTES {
        return Ok((name, Value::Other("an array that is too large".into())));
    }
    Ok((name, npy::array(&content)?))
}
