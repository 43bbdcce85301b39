//! Why a file was not exported.

use std::io::{self, ErrorKind};
use std::path::{Path, PathBuf};

use bench_recording::RecordingError;

/// Why a file was not exported.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExportError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The file exists.
    #[error(
        "--out {path}: the file exists, and no file is replaced; choose another file with --out, or move it away",
        path = path.display()
    )]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// A folder, a FIFO, a socket or a device.
    #[error("--out {path} is {kind}, not a regular file; choose the name of a new file with --out", path = path.display())]
    Special {
        /// The file.
        path: PathBuf,
        /// What it is.
        kind: &'static str,
    },
    /// The file cannot be written. The path is empty until the file is known.
    #[error("cannot write {path}: {source}; {remedy}", path = path.display(), remedy = remedy(path, source))]
    Write {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// UFF 58 has regular times only.
    #[error(
        "the recording lacks ticks between tick {after_tick} and tick {before_tick}, but signals in UFF 58 have regular times; \
         use --format csv, parquet or mat"
    )]
    Uneven {
        /// The last tick before the first gap.
        after_tick: u64,
        /// The first tick after it.
        before_tick: u64,
    },
    /// A variable of a MAT-file has at most 2^32 bytes.
    #[error(
        "a variable of {bytes} bytes is larger than the 2^32 bytes of a MAT-file of level 5; use --format parquet or csv"
    )]
    TooLarge {
        /// Size of the variable.
        bytes: u64,
    },
    /// The ticks are not those that were counted.
    #[error("the recording was changed while it was exported; export it again")]
    Changed,
    /// The program was built without Parquet.
    #[error(
        "--format parquet is not available, because this `bench` was built without Parquet; build it with `--features parquet`, or \
         use --format csv, mat or uff58"
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

impl ExportError {
    /// The error with the name of the file.
    pub(super) fn at(self, path: &Path) -> ExportError {
        match self {
            ExportError::Write { source, .. } => ExportError::Write {
                path: path.to_owned(),
                source,
            },
            other => other,
        }
    }

    /// Whether data or files are the reason, and not options.
    pub fn is_failure(&self) -> bool {
        match self {
            ExportError::Recording(_)
            | ExportError::Write { .. }
            | ExportError::TooLarge { .. }
            | ExportError::Changed => true,
            ExportError::Exists { .. }
            | ExportError::Special { .. }
            | ExportError::Uneven { .. }
            | ExportError::WithoutParquet => false,
        }
    }
}

/// What to do about an error of writing.
fn remedy(path: &Path, error: &io::Error) -> String {
    let folder = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty());
    let what = match (error.kind(), folder) {
        (ErrorKind::NotFound, Some(folder)) => &format!("create the folder {}", folder.display()),
        (ErrorKind::StorageFull | ErrorKind::QuotaExceeded, _) => "free some space",
        (ErrorKind::FileTooLarge, _) => "raise the limit of the size of a file (ulimit -f)",
        (ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem, _) => {
            return "choose a folder that you may write to with --out".into();
        }
        _ => return "choose another file with --out".into(),
    };
    format!("{what}, or choose another file with --out")
}
