//! Opens a file of another program.

use std::path::Path;

use bench_base::input_file::{self, MAX_RECORD_BYTES};

use super::content::Content;
use super::error::{DataError, ExternalCsvError};

/// The content of a file.
pub(crate) fn content(path: &Path) -> Result<Content, ExternalCsvError> {
    let bytes = input_file::read(path, MAX_RECORD_BYTES);
    let bytes = bytes.map_err(|source| ExternalCsvError::File(path.to_owned(), source))?;
    let content = Content::of(bytes).map_err(|format| DataError::Foreign {
        path: path.to_owned(),
        format,
    })?;
    Ok(content)
}
