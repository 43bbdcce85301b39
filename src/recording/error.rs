//! What can go wrong with a recording: what, where, and what to do about it.

use std::io;
use std::path::PathBuf;

use mcap::McapError;

/// A recording could not be written or read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The name is taken.
    #[error("{}: this recording exists, and a recording is never overwritten; choose another name or move it away", path.display())]
    Exists {
        /// The file that exists.
        path: PathBuf,
    },
    /// The file could not be made.
    #[error("{}: cannot create the recording: {source}; check that its directory exists and may be written to", path.display())]
    Create {
        /// The file that was to be made.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Data could not be written.
    #[error("{}: writing failed after {ticks} ticks: {}; {}", path.display(), why(source), remedy_of_writing(source))]
    Write {
        /// The file.
        path: PathBuf,
        /// Ticks handed over until then. The file itself lacks up to the last half second of them.
        ticks: u64,
        /// What the system or the format says.
        source: McapError,
    },
    /// A tick came whose number is not above the one before it.
    #[error("{}: tick {tick} follows tick {after}, but tick numbers must increase; use one recording for each run of the loop", path.display())]
    Order {
        /// The file.
        path: PathBuf,
        /// The tick that came.
        tick: u64,
        /// The tick before it.
        after: u64,
    },
    /// The recorder's thread could not be started or died.
    #[error(
        "the recorder's thread {what}; the recording is cut off there: `bench recover` makes it whole"
    )]
    Thread {
        /// What happened to it.
        what: String,
    },
    /// There is no such file.
    #[error("{}: no such file; check the name, recordings land in recordings/ unless told otherwise", path.display())]
    Missing {
        /// The name given.
        path: PathBuf,
    },
    /// The file could not be read.
    #[error("{}: cannot read the recording: {source}; check that it is a file and that you may read it", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file does not begin as an MCAP file does.
    #[error("{}: not an MCAP file; give a recording made by bench (*.mcap)", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// An MCAP file, but of another program.
    #[error("{}: an MCAP file without bench's channel /loop ({found}); give a recording made by bench", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Which channels it has.
        found: String,
    },
    /// A recording without one tick.
    #[error("{}: the recording holds no ticks ({state}); the loop did not run, record anew", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
        /// Whether it is complete or cut off.
        state: &'static str,
    },
    /// Bytes of the file were altered, or parts of it are missing within.
    #[error("{}: damaged at byte {at_byte}, after {ticks} good ticks: {what}; \
        `bench recover` saves the data before the damage", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where the first record that cannot be trusted begins.
        at_byte: u64,
        /// Ticks before it.
        ticks: u64,
        /// What is wrong.
        what: String,
    },
}

/// The system's own words if there are such, else those of the format.
pub(super) fn why(error: &McapError) -> String {
    match error {
        McapError::Io(source) => source.to_string(),
        other => other.to_string(),
    }
}

fn remedy_of_writing(error: &McapError) -> &'static str {
    match error {
        McapError::Io(e)
            if matches!(
                e.kind(),
                io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded
            ) =>
        {
            "free space or record to another disk; `bench recover` makes what was written whole"
        }
        _ => "check the disk; `bench recover` makes what was written whole",
    }
}
