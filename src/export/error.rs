//! Why a file was not exported.

use std::io;
use std::path::PathBuf;

use crate::recording::RecordingError;

/// Why a file was not exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The file cannot be written. The path is empty until the file is known.
    #[error("cannot write {path}: {source}; free some space, or choose another file with --out", path = path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// UFF 58 has regular times only.
    #[error(
        "the recording lacks ticks after {time_s} s, but signals in UFF 58 have regular times; use --format csv, parquet or mat"
    )]
    Uneven {
        /// Time of the tick before the gap.
        time_s: f64,
    },
    /// A variable of a MAT-file has at most 2^32 bytes.
    #[error(
        "a variable of {bytes} bytes is larger than the 2^32 bytes of a MAT-file of level 5; use --format parquet or csv"
    )]
    TooLarge {
        /// Size of the variable.
        bytes: u64,
    },
    /// The program was built without Parquet.
    #[error(
        "--format parquet is not available, because this `bench` was built without Parquet; build it with `--features parquet`, or use --format csv"
    )]
    WithoutParquet,
}

impl From<io::Error> for ExportError {
    fn from(source: io::Error) -> ExportError {
        ExportError::Write {
            path: PathBuf::new(),
            source,
        }
    }
}
