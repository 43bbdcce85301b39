//! One command of the queue, from its entry to its end.

use std::time::Instant;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::hold::StopKind;
use super::secret::Secret;
use bench_base::progress::Progress;
use bench_experiment::{Description, operator_name, run_name, run_note};
use bench_rt::supervision::StopFlags;

/// Commands that may be queued.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Command {
    /// Excite the stage and estimate its frequency response.
    Chirp,
    /// Run the closed loop with a reference.
    Control,
    /// Measure scale, sign and offset of amplifier and probe.
    Calibrate,
    /// Excite the stage at several amplitudes.
    Linearity,
    /// A chirp at each point of a grid.
    Campaign,
    /// Analyse a recording, without motion.
    Identify,
}

impl Command {
    /// All commands.
    pub const ALL: [Command; 6] = [
        Command::Chirp,
        Command::Control,
        Command::Calibrate,
        Command::Linearity,
        Command::Campaign,
        Command::Identify,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Command::Chirp => "chirp",
            Command::Control => "control",
            Command::Calibrate => "calibrate",
            Command::Linearity => "linearity",
            Command::Campaign => "campaign",
            Command::Identify => "identify",
        }
    }
}

/// What happens to a run whose client disappears.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnDisconnect {
    /// A closed loop settles to zero current, everything else goes on to its end.
    #[default]
    Default,
    /// The run settles to zero current.
    Stop,
    /// The run goes on to its end.
    Continue,
}

/// What a client asks for.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RunRequest {
    /// The command.
    pub command: Command,
    /// Its arguments, as on the command line.
    #[serde(default)]
    pub args: Vec<String>,
    /// A name for the list of recordings.
    #[serde(default)]
    pub name: String,
    /// A note of the operator.
    #[serde(default)]
    pub note: String,
    /// What happens if the client disappears.
    #[serde(default)]
    pub on_disconnect: OnDisconnect,
}

impl RunRequest {
    /// Whether the run settles when its client disappears.
    pub fn ends_with_client(&self) -> bool {
        match (self.on_disconnect, self.command) {
            (OnDisconnect::Stop, _) | (OnDisconnect::Default, Command::Control) => true,
            (OnDisconnect::Continue, _)
            | (
                OnDisconnect::Default,
                Command::Chirp
                | Command::Calibrate
                | Command::Linearity
                | Command::Campaign
                | Command::Identify,
            ) => false,
        }
    }
}

/// Who carries out the command.
#[derive(Clone, Debug)]
pub enum Carrier {
    /// A process of this machine, which waits for its turn.
    Attached,
    /// A process that the daemon starts. It shows its ticket.
    Started {
        /// The ticket.
        ticket: Secret,
    },
}

/// How far a command is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// It waits for the commands before it.
    Queued,
    /// It waits until the bench is resumed after a stop or a trip.
    Held,
    /// It is next, but another operator holds the lease.
    WaitingForLease,
    /// It has its turn and prepares its run.
    Starting,
    /// Its run goes on.
    Running,
    /// Its process analyses the recording.
    Analysing,
    /// It has ended.
    Finished,
}

/// How a command ended.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum RunOutcome {
    /// It did what it was asked for.
    Completed,
    /// An interlock tripped.
    Tripped,
    /// It was stopped.
    Stopped,
    /// It was refused, or it failed.
    Failed,
}

impl RunOutcome {
    /// The name in the interface.
    pub fn name(self) -> &'static str {
        match self {
            RunOutcome::Completed => "completed",
            RunOutcome::Tripped => "tripped",
            RunOutcome::Stopped => "stopped",
            RunOutcome::Failed => "failed",
        }
    }
}

/// One command of the queue.
#[derive(Clone, Debug)]
pub struct RunEntry {
    /// Number, from 1.
    pub id: u64,
    /// What the client asked for.
    pub request: RunRequest,
    /// Who carries it out.
    pub carrier: Carrier,
    /// The operator.
    pub operator: String,
    /// The lease with which it was queued; an attached process takes a lease at its turn.
    pub lease: Option<Secret>,
    /// How far it is.
    pub phase: Phase,
    /// When it was queued, in seconds since 1970.
    pub queued_unix_s: f64,
    /// When its turn began.
    pub started_unix_s: Option<f64>,
    /// When it ended.
    pub ended_unix_s: Option<f64>,
    /// Its length by the plan, in seconds; `None` if it is not known.
    pub estimated_s: Option<f64>,
    /// Ends the run in progress.
    pub stop: StopFlags,
    /// Whether somebody stopped it.
    pub is_stopped: bool,
    /// When its turn ends at the latest, because it was stopped and has no run.
    pub turn_ends: Option<Instant>,
    /// Whether a process that the daemon started for it still works, perhaps after the end of its turn.
    pub has_process: bool,
    /// Whether its client has disappeared.
    pub is_orphan: bool,
    /// How it ended.
    pub outcome: Option<RunOutcome>,
    /// Exit code of its process.
    pub exit_code: Option<i32>,
    /// The error, if it has one.
    pub message: Option<String>,
    /// File name of its last recording.
    pub recording: Option<String>,
    /// Progress of its run.
    pub progress: Option<Progress>,
}

impl RunEntry {
    /// Name, note and operator for the recording. An attached process states its operator itself, if it knows one.
    pub fn description(&self) -> Description {
        Description {
            name: run_name(&self.request.name).ok(),
            note: run_note(&self.request.note).ok(),
            operator: match self.carrier {
                Carrier::Attached => None,
                Carrier::Started { .. } => operator_name(&self.operator).ok(),
            },
            invocation: None,
        }
    }

    /// Whether its turn has begun and not ended.
    pub fn is_current(&self) -> bool {
        match self.phase {
            Phase::Starting | Phase::Running | Phase::Analysing => true,
            Phase::Queued | Phase::Held | Phase::WaitingForLease | Phase::Finished => false,
        }
    }

    /// Raises the stop flags of the run: once to settle it, twice to cut the current. Without a run, the turn ends at `turn_ends`.
    pub fn stop(&mut self, kind: StopKind, turn_ends: Instant) {
        if self.phase != Phase::Running {
            self.turn_ends.get_or_insert(turn_ends);
        }
        let was_stopped = std::mem::replace(&mut self.is_stopped, true);
        match (kind, was_stopped) {
            // A second request to settle does not cut the current.
            (StopKind::Settle, true) => {}
            (StopKind::Settle, false) => self.stop.raise(),
            (StopKind::Cut, true) => self.stop.raise(),
            (StopKind::Cut, false) => {
                self.stop.raise();
                self.stop.raise();
            }
        }
    }
}
