//! Why a file of another program is refused.

use std::path::PathBuf;

/// Why the bytes of a file cannot be read.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FormatError {
    /// The end of the file, or of a part of it, comes too early, or a size is impossible.
    #[error("it is damaged or incomplete at byte {at} ({what}); save it again")]
    Damaged {
        /// Offset in bytes, in the decompressed data of a compressed part.
        at: usize,
        /// What was expected.
        what: &'static str,
    },
    /// Another kind of file.
    #[error("it is {what}; {remedy}")]
    Kind {
        /// What the file is.
        what: &'static str,
        /// What to do.
        remedy: &'static str,
    },
    /// Text that is not JSON.
    #[error(
        "it is not a JSON object: {0}; write one object with the names num, den, Ts (or z, p, k, Ts, or A, B, C, D, Ts)"
    )]
    Json(String),
    /// More data than a controller has.
    #[error("{what} exceeds the limit of {limit} {unit}; save only the arrays of the controller")]
    TooLarge {
        /// What is too large.
        what: &'static str,
        /// The limit.
        limit: usize,
        /// Its unit.
        unit: &'static str,
    },
}

/// A file that cannot be imported.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The operating system refused it.
    #[error("cannot read {}: {why}; check that it is a file and that you may read it", .path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// Reason.
        why: String,
    },
    /// The bytes are not those of a known format.
    #[error("cannot read {}: {why}", .path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Reason.
        why: FormatError,
    },
    /// No controller, or several.
    #[error("{}: {why}", .path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// What is wrong, and the remedy.
        why: String,
    },
}

impl ImportError {
    /// The file.
    pub fn path(&self) -> &PathBuf {
        match self {
            ImportError::Unreadable { path, .. }
            | ImportError::Format { path, .. }
            | ImportError::Content { path, .. } => path,
        }
    }
}
