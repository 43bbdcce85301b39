//! Why the arrays of a file cannot be read.

use thiserror::Error;

/// Why the arrays of a file cannot be read.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
#[non_exhaustive]
pub enum ArraysError {
    /// The end of the file or of a part comes too early, or a part is impossible.
    #[error("{}damaged or incomplete at byte {at} ({what})", subject(.variable.as_ref()))]
    Damaged {
        /// The variable, if its name is known.
        variable: Option<String>,
        /// Offset in bytes: in the file, of a packed variable of a MAT-file that of its beginning, in an NPZ file that in the array.
        at: u64,
        /// What was expected there.
        what: &'static str,
    },
    /// The list of the arrays of an HDF5 file cannot be read.
    #[error(
        "it is an HDF5 file whose list of arrays cannot be read ({reason}), as one that is damaged or was not closed"
    )]
    Hdf5 {
        /// What the reader of the format reports.
        reason: String,
    },
    /// A Parquet file cannot be read.
    #[error("it is a Parquet file that cannot be read ({reason})")]
    Parquet {
        /// What the reader of the format reports.
        reason: String,
    },
    /// More numbers than the limit.
    #[error("it has more than {limit} bytes of numbers")]
    TooLarge {
        /// The limit in bytes.
        limit: u64,
    },
}

impl ArraysError {
    /// The same error with the name of the variable in which it was found, if it has none.
    pub(crate) fn in_variable(self, name: &str) -> ArraysError {
        match self {
            ArraysError::Damaged {
                variable: None,
                at,
                what,
            } => ArraysError::Damaged {
                variable: Some(name.into()),
                at,
                what,
            },
            other => other,
        }
    }
}

fn subject(variable: Option<&String>) -> String {
    variable.map_or("it is ".into(), |name| format!("variable `{name}` is "))
}
