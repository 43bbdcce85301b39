//! Paths as texts.
//!
//! What is not UTF-8 is replaced by U+FFFD: an order as text is shown and sent, and the process that opens the file has the path itself.

use std::path::PathBuf;

use serde::{Serialize, Serializer};

/// A path as text, if it is given.
pub(crate) fn optional_path_text<S: Serializer>(
    path: &Option<PathBuf>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    let text = path.as_ref().map(|path| path.to_string_lossy());
    text.serialize(serializer)
}
