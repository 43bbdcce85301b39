//! Why a run was refused or failed.

use std::path::PathBuf;

use crate::plan::PlanError;
use bench_recording::{MIN_FREE_BYTES, RecordingError};

/// A run that was refused, or that failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The plan is refused.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The recording could not be created.
    #[error("{0}; nothing was moved")]
    Create(RecordingError),
    /// The folder could not be created.
    #[error(
        "cannot create the folder {folder} for recordings: {why}; choose another folder with --out; nothing was moved"
    )]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The error of the operating system.
        why: String,
    },
    /// The disk has too little free space.
    #[error(
        "{}: {:.1} MB are free, but the recording may need {:.1} MB and must leave {:.0} MB; free some space, shorten the run or choose another folder with --out; nothing was moved",
        folder.display(), megabytes(*free_bytes), megabytes(*needed_bytes), megabytes(MIN_FREE_BYTES)
    )]
    Space {
        /// The folder for the recording.
        folder: PathBuf,
        /// Free space in bytes.
        free_bytes: u64,
        /// Upper limit of the size of the recording in bytes.
        needed_bytes: u64,
    },
    /// Somebody stopped the run before its first tick.
    #[error("stopped before the run began; start it again; nothing was moved")]
    StoppedBefore,
    /// The recording failed.
    #[error("{0}; the run was stopped with zero current")]
    Recording(#[from] RecordingError),
    /// The recording failed, and the run went on.
    #[error(
        "{0}; the run went on to its end without a recording, as loop.on_recording_failure orders"
    )]
    Unrecorded(RecordingError),
    /// The operating system refused a thread or the supervisor.
    #[error("cannot {what}: {why}; raise the limit of processes (ulimit -u)")]
    System {
        /// The action that failed.
        what: &'static str,
        /// The error of the operating system.
        why: String,
    },
    /// The thread of an analysis or of a computation panicked.
    #[error("the thread of the analysis panicked; report this with the command and its input")]
    AnalysisDied,
    /// The thread of the loop panicked.
    #[error(
        "the thread of the loop panicked, and the amplifier was disabled; report this with the recording up to then, {0}"
    )]
    LoopDied(PathBuf),
}

fn megabytes(bytes: u64) -> f64 {
    bytes as f64 * 1e-6
}

impl RunError {
    /// Turns an error of the operating system into a [`RunError::System`].
    pub(crate) fn system(what: &'static str) -> impl Fn(std::io::Error) -> RunError {
        move |error| RunError::System {
            what,
            why: error.to_string(),
        }
    }
}
