//! Errors of recordings: what is wrong, in which file, and what to do about it.

use std::io;
use std::path::PathBuf;

use mcap::McapError;

/// A recording that could not be written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// The file exists.
    #[error("{}: this recording exists, and a recording is never overwritten; choose another name or move it away", path.display())]
    Exists {
        /// The file that exists.
        path: PathBuf,
    },
    /// The process that owns the rig could not complete the file.
    #[error("{0}")]
    Remote(String),
    /// Another process, or another run of this one, writes the file.
    #[error("{}: this recording is still being written; wait until its run has ended", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// The file could not be created.
    #[error("{}: cannot create the recording: {source}; check that its directory exists and may be written to", path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The file could not be read.
    #[error("{}: cannot read the recording: {source}; check that it is a file and that you may read it", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// Data could not be written.
    #[error("{}: writing failed after {ticks} ticks: {}; {}", path.display(), why(source), remedy_of_writing(source))]
    Write {
        /// The file.
        path: PathBuf,
        /// Ticks received until then. The file lacks up to the last half second of them.
        ticks: u64,
        /// The error of the operating system or of the format.
        source: McapError,
    },
    /// A tick whose number is not larger than the previous one.
    #[error("{}: tick {tick} follows tick {after}, but tick numbers must increase; use one recording for each run of the loop", path.display())]
    Order {
        /// The file.
        path: PathBuf,
        /// The tick.
        tick: u64,
        /// The previous tick.
        after: u64,
    },
    /// A run went on after it was ordered to end.
    #[error("{}: the run did not end when its recording became too large for the disk or for its plan, so the recording ends \
        after {ticks} ticks; complete it with `bench recover`, and report this", path.display())]
    Endless {
        /// The file.
        path: PathBuf,
        /// Ticks received until then.
        ticks: u64,
    },
    /// The file was removed while it was written.
    #[error("{}: the recording was removed during the run, so its data are lost; record again, and do not change the folder during a run", path.display())]
    Removed {
        /// The file.
        path: PathBuf,
    },
    /// The thread of the recorder could not be started.
    #[error("{}: cannot start the thread of the recorder: {source}; raise the limit of processes (ulimit -u)", path.display())]
    NotStarted {
        /// The file, which has no ticks.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// The thread of the recorder panicked.
    #[error("{0}: the thread of the recorder panicked, and the recording is cut off there; \
        complete it with `bench recover {0}`", path.display())]
    Panicked {
        /// The file.
        path: PathBuf,
    },
    /// The file does not exist.
    #[error("{}: no such file; check the name (recordings are in the folder recordings/ unless --out named another)", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The file does not begin like an MCAP file.
    #[error("{}: not an MCAP file; give a recording made by bench (*.mcap)", path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// An MCAP file of another program.
    #[error("{}: not a recording of bench: an MCAP file without bench's channel /loop ({channels}); give a recording made by bench", path.display())]
    OtherProgram {
        /// The file.
        path: PathBuf,
        /// Its channels.
        channels: String,
    },
    /// A recording without ticks.
    #[error("{}: the recording has no ticks ({}), so there is nothing to read; record again", path.display(), emptiness.why())]
    Empty {
        /// The file.
        path: PathBuf,
        /// Why it has none.
        emptiness: Emptiness,
    },
    /// Another recording follows in the file.
    #[error("{}: this file holds more than one recording, another one begins at byte {next_at_byte}; \
        write each to a file of its own with `bench recover`", path.display())]
    Several {
        /// The file.
        path: PathBuf,
        /// Where the next recording begins.
        next_at_byte: u64,
    },
    /// The content of the file was changed, or parts of it are missing.
    #[error("{}: damaged at byte {at_byte}, after {ticks} good ticks: {what}; \
        copy the intact data to a new recording with `bench recover`", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Start of the first damaged record.
        at_byte: u64,
        /// Ticks before it.
        ticks: u64,
        /// What is wrong.
        what: String,
    },
}

/// Why a recording has no ticks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Emptiness {
    /// The loop did not run.
    Complete,
    /// The file ends before the first ticks.
    CutOff,
    /// Everything with ticks is damaged.
    Damaged,
}

impl Emptiness {
    pub(super) fn why(self) -> &'static str {
        match self {
            Emptiness::Complete => "it is complete",
            Emptiness::CutOff => "it was cut off before its first half second was written",
            Emptiness::Damaged => "every part of the file with ticks is damaged",
        }
    }
}

/// The text of an error; of an error of the operating system without that of the format.
pub(super) fn why(error: &McapError) -> String {
    match error {
        McapError::Io(source) => source.to_string(),
        other => other.to_string(),
    }
}

fn remedy_of_writing(error: &McapError) -> &'static str {
    use io::ErrorKind::{QuotaExceeded, StorageFull};
    match error {
        McapError::Io(e) if matches!(e.kind(), StorageFull | QuotaExceeded) => {
            "free some space or record to another disk, and complete what was written with `bench recover`"
        }
        _ => "check the disk, and complete what was written with `bench recover`",
    }
}
