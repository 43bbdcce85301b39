//! The hold of the bench: after a stop or a trip nothing begins until the holder of the arm lease resumes.
//!
//! ```text
//!            stop by anybody, trip
//!   released ---------------------> held ----+
//!      ^                             |  ^    | another stop, another trip: the first cause remains
//!      |                             |  +----+
//!      +-----------------------------+
//!       resume by the holder of the arm lease
//! ```
//!
//! While the bench is held, no command gets its turn, and the command that has its turn begins no further run. Commands are still
//! accepted into the queue. The end of a lease or of a client does not release the bench.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use bench_base::timestamp::seconds_since_1970;

/// How a run is stopped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StopKind {
    /// The current goes to zero along a ramp.
    #[default]
    Settle,
    /// Zero current at once.
    Cut,
}

/// What held the bench.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HoldCause {
    /// Somebody stopped it.
    Stop,
    /// An interlock tripped.
    Trip,
}

/// Since when and why the bench is held.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Hold {
    /// What held it.
    pub cause: HoldCause,
    /// Who stopped it, or which interlock tripped, in words.
    pub by: String,
    /// Since when, in seconds since 1970.
    pub since_unix_s: f64,
    /// How the run was stopped; `null` after a trip, which cuts the current.
    pub how: Option<StopKind>,
    /// Number of the run that was stopped or tripped; `null` if nothing had its turn.
    pub run: Option<u64>,
}

impl Hold {
    /// Takes note of a later stop: a cut of the same run replaces its settling.
    pub fn add_stop(&mut self, how: StopKind) {
        if self.how.is_some() && how == StopKind::Cut {
            self.how = Some(StopKind::Cut);
        }
    }

    /// What the operator of a waiting command reads.
    pub fn notice(&self) -> String {
        format!(
            "the bench is held: {self}; this command waits. When the cause is removed, resume with `bench resume` or on the live page"
        )
    }
}

/// As a clause: `stopped by anna at 2026-11-26T14:02:41Z`.
impl fmt::Display for Hold {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let time = seconds_since_1970(self.since_unix_s);
        let by = &self.by;
        match self.cause {
            HoldCause::Stop => write!(formatter, "stopped by {by} at {time}"),
            HoldCause::Trip => write!(formatter, "tripped by {by} at {time}"),
        }
    }
}
