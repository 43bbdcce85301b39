//! What the interface shows of the daemon.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::body::FromJson;
use crate::hold::Hold;
use crate::lease::Lease;
use crate::live::hub::{LoopView, Share, TripView};
use crate::run_entry::{OnDisconnect, Phase, RunEntry};
use crate::schedule::Now;
use crate::shared::{Daemon, now};
use bench_base::progress::Snapshot;
use bench_experiment::EndKind;
use bench_order::{Command, Order};
use bench_rig::devices::is_simulated;

/// Everything at one moment.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct StateView {
    /// The daemon.
    pub daemon: DaemonView,
    /// The loop.
    #[serde(rename = "loop")]
    pub servo: LoopView,
    /// Quantities as a share of their interlock; it trips at 1.
    pub shares: Vec<Share>,
    /// The last trip, until it is acknowledged.
    pub trip: Option<TripView>,
    /// Why nothing begins after a stop or a trip, until the holder of the lease resumes; `null` while the bench is released.
    pub held: Option<Hold>,
    /// Who holds the arm lease.
    pub lease: Option<LeaseView>,
    /// The command that has its turn.
    pub run: Option<RunView>,
    /// The commands that wait.
    pub queue: Vec<RunView>,
}

/// The daemon.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct DaemonView {
    /// Version of the program.
    pub version: String,
    /// Start in seconds since 1970.
    pub started_unix_s: f64,
    /// Why it started.
    pub start_reason: String,
    /// Profile or file of the configuration.
    pub config: String,
    /// Settings over it, as KEY=VALUE.
    pub sets: Vec<String>,
    /// `simulated` or `devices`.
    pub rig: String,
    /// The amplifier, as it reports itself; `null` while it is not open.
    pub amplifier: Option<String>,
    /// The probe; `null` while it is not open.
    pub probe: Option<String>,
    /// Why the rig is not open, or cannot be used.
    pub fault: Option<String>,
    /// Folder of the recordings.
    pub recordings: String,
}

/// Who holds the arm lease.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct LeaseView {
    /// The operator.
    pub operator: String,
    /// Since when, in seconds since 1970.
    pub since_unix_s: f64,
    /// Seconds until it expires without a renewal; `null` if a run holds it until its end.
    pub expires_in_s: Option<f64>,
}

/// A command of the queue.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct RunView {
    /// Number.
    pub id: u64,
    /// The command.
    pub command: Command,
    /// Its arguments as on the command line.
    pub args: Vec<String>,
    /// The order: the command with its options.
    pub order: Order,
    /// Its name.
    pub name: String,
    /// Note of the operator.
    pub note: String,
    /// The operator.
    pub operator: String,
    /// What happens if the client disappears.
    pub on_disconnect: OnDisconnect,
    /// How far it is.
    pub phase: Phase,
    /// When it was queued, in seconds since 1970.
    pub queued_unix_s: f64,
    /// When its turn began.
    pub started_unix_s: Option<f64>,
    /// When it ended.
    pub ended_unix_s: Option<f64>,
    /// Length by the plan in seconds.
    pub estimated_s: Option<f64>,
    /// Progress of its run.
    pub progress: Option<ProgressView>,
    /// How it ended.
    pub outcome: Option<EndKind>,
    /// Exit code of its process.
    pub exit_code: Option<i32>,
    /// Whether its process still works; it may do so for some time after a stop has ended its turn.
    pub has_process: bool,
    /// The error.
    pub message: Option<String>,
    /// File name of its last recording.
    pub recording: Option<String>,
    /// Whether its client has disappeared.
    pub is_orphan: bool,
}

/// Progress of a run.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ProgressView {
    /// Name of the stage.
    pub stage: String,
    /// Finished steps.
    pub done: u64,
    /// All steps; 0 if their number is not known.
    pub total: u64,
    /// Time since the stage began.
    pub elapsed_s: f64,
    /// Estimate of the time that is left.
    pub remaining_s: Option<f64>,
}

impl From<Snapshot> for ProgressView {
    fn from(now: Snapshot) -> ProgressView {
        ProgressView {
            stage: now.stage.into(),
            done: now.done,
            total: now.total,
            elapsed_s: now.elapsed.as_secs_f64(),
            remaining_s: now.remaining().map(|left| left.as_secs_f64()),
        }
    }
}

impl From<&RunEntry> for RunView {
    fn from(entry: &RunEntry) -> RunView {
        let progress = entry.progress.as_ref().filter(|_| entry.is_current());
        RunView {
            id: entry.id,
            command: entry.request.order.command(),
            args: entry.request.order.arguments(),
            order: entry.request.order.clone(),
            name: entry.request.name.clone(),
            note: entry.request.note.clone(),
            operator: entry.operator.clone(),
            on_disconnect: entry.request.on_disconnect,
            phase: entry.phase,
            queued_unix_s: entry.queued_unix_s,
            started_unix_s: entry.started_unix_s,
            ended_unix_s: entry.ended_unix_s,
            estimated_s: entry.estimated_s,
            progress: progress.map(|progress| progress.snapshot().into()),
            outcome: entry.outcome,
            exit_code: entry.exit_code,
            has_process: entry.has_process,
            message: entry.message.clone(),
            recording: entry.recording.clone(),
            is_orphan: entry.is_orphan,
        }
    }
}

/// All commands.
#[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
pub struct Operator {
    /// Name of the operator.
    pub operator: String,
}

impl FromJson for Operator {}

fn lease_view(lease: &Lease, now: Now) -> LeaseView {
    LeaseView {
        operator: lease.operator.clone(),
        since_unix_s: lease.since_unix_s,
        expires_in_s: lease.expires_in_s(now.instant),
    }
}

/// The state at this moment.
pub fn state(daemon: &Daemon) -> StateView {
    let (lease, held, run, queue) = daemon.read(|schedule| {
        let lease = schedule.lease().map(|lease| lease_view(lease, now()));
        let run = schedule.current().map(RunView::from);
        let queue = schedule.queue().map(RunView::from).collect();
        (lease, schedule.hold().cloned(), run, queue)
    });
    let live = daemon.live.snapshot();
    let rig = daemon.owner.status();
    let servo = LoopView {
        pace: rig.pace.name().into(),
        policy: rig.scheduling.policy,
        memory_locked: rig.scheduling.memory_locked,
        refused: rig.scheduling.refused,
        recording_defect: daemon
            .owner
            .recording_defect()
            .map(|cause| cause.text().into()),
        ..live.servo
    };
    StateView {
        daemon: daemon_view(daemon),
        servo,
        shares: live.shares,
        trip: live.trip,
        held,
        lease,
        run,
        queue,
    }
}

fn daemon_view(daemon: &Daemon) -> DaemonView {
    let configuration = daemon.configuration();
    let rig = daemon.owner.status();
    let kind = if is_simulated(&configuration.config) {
        "simulated"
    } else {
        "devices"
    };
    let (amplifier, probe) = rig
        .names
        .map(|names| (names.amplifier, names.probe))
        .unzip();
    let source = configuration.source.clone();
    DaemonView {
        version: env!("CARGO_PKG_VERSION").into(),
        started_unix_s: daemon.started_unix_s,
        start_reason: daemon.start_reason.clone(),
        config: source
            .config
            .unwrap_or_else(|| bench_config::profiles::DEFAULT.into()),
        sets: source.sets,
        rig: kind.into(),
        amplifier,
        probe,
        fault: rig.fault,
        recordings: daemon.recordings.display().to_string(),
    }
}
