//! Why a run could not be made, or failed.

use std::path::PathBuf;

use super::plan_error::PlanError;
use crate::recording::RecordingError;

/// A run that could not be made, or whose recording failed.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The plan is refused.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The recording could not be made; nothing was moved.
    #[error("{0}; nothing was moved")]
    Create(RecordingError),
    /// The folder could not be made; nothing was moved.
    #[error(
        "cannot make the folder {folder} for recordings: {why}; choose another with --out; nothing was moved"
    )]
    Folder {
        /// The folder.
        folder: PathBuf,
        /// The system's words.
        why: String,
    },
    /// The recording failed; the run was stopped.
    #[error("{0}; the run was stopped with zero current")]
    Recording(#[from] RecordingError),
    /// The system refused a thread or the supervisor.
    #[error("cannot {what}: {why}")]
    System {
        /// What was asked.
        what: &'static str,
        /// The system's words.
        why: String,
    },
    /// The loop's thread died; the amplifier was disabled on the way.
    #[error("the loop's thread died; the amplifier was disabled; the recording up to there is {0}")]
    LoopDied(PathBuf),
}
