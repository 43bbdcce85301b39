//! How a command of this process ended: its exit code.

use std::process::ExitCode;

/// The exit code of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Exit {
    /// The command is done.
    Done,
    /// The command failed, or the run was tripped or stopped, or a replay differs.
    Failed,
    /// Wrong usage or configuration; nothing was moved.
    Usage,
    /// Done, but with overruns or lost records.
    Impaired,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> ExitCode {
        ExitCode::from(match exit {
            Exit::Done => 0,
            Exit::Failed => 1,
            Exit::Usage => 2,
            Exit::Impaired => 3,
        })
    }
}
