//! How a command ended, and its exit code.

use std::process::ExitCode;

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The command is done.
    Done,
    /// The command failed, or the run was tripped or stopped, or a replay differs.
    Failed,
    /// Wrong usage or configuration; nothing was moved.
    Usage,
    /// Done, but with overruns or lost records.
    Impaired,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> ExitCode {
        ExitCode::from(match outcome {
            Outcome::Done => 0,
            Outcome::Failed => 1,
            Outcome::Usage => 2,
            Outcome::Impaired => 3,
        })
    }
}
