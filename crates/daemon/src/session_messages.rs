//! Messages between a command on this machine and the daemon that owns the rig. One connection is one command: it waits for its turn,
//! runs its plans one after the other, and ends when the connection closes.
//!
//! ```text
//!  command: Open -----------------> Run ------Alive*-Stop*-----------> Finish ----> (Run ... or close)
//!  daemon:        Waiting* Granted       Progress* Warning* Ended               Finished
//! ```
//!
//! `Alive` renews the arm lease of the run. A command that is suspended or hangs sends none, and its closed loop ends.

use serde::{Deserialize, Serialize};

use super::run_entry::RunRequest;
use super::schedule::StopKind;
use bench_experiment::{PlannedRun, RemoteError, RunReport};
use bench_recording::Totals;

/// Largest message of a command in bytes. The largest parts of a message are the text of a reference (some 20 bytes a tick) and the
/// responses in the results (some 100 bytes a frequency).
pub const MAX_MESSAGE_BYTES: usize = 16 << 20;

/// From the command to the daemon.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FromCommand {
    /// Asks for a turn.
    Open(Box<OpenCommand>),
    /// Orders a run.
    Run(Box<PlannedRun>),
    /// The command waits for the end of its run.
    Alive,
    /// Stops the run.
    Stop(StopKind),
    /// Adds the results as JSON to the recording of the last run and closes it.
    Finish(String),
}

/// A command that asks for its turn. Its user is not stated here: the kernel knows it.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OpenCommand {
    /// The command.
    pub request: RunRequest,
    /// The operator.
    pub operator: String,
    /// The ticket of a process that the daemon started.
    pub ticket: Option<String>,
    /// Length of its first run in seconds, if it takes real time.
    pub estimated_s: Option<f64>,
}

/// From the daemon to the command.
#[derive(Debug, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FromDaemon {
    /// The command waits.
    Waiting(String),
    /// The command has its turn.
    Granted,
    /// Progress of the run.
    Progress {
        /// Finished steps.
        done: u64,
        /// All steps; 0 if their number is not known.
        total: u64,
    },
    /// A warning for the operator.
    Warning(String),
    /// The run has ended.
    Ended(Box<RunReport>),
    /// The turn or the run is refused, or the run failed.
    Refused(RemoteError),
    /// The recording is complete.
    Finished(Totals),
    /// The recording could not be completed.
    NotFinished(String),
}
