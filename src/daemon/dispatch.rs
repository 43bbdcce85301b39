//! Gives the commands of the queue their turn, one after the other.

use std::sync::Arc;
use std::time::Duration;

use super::output::RunOutput;
use super::run_entry::{Carrier, Phase, RunEntry, RunOutcome};
use super::secret::Secret;
use super::shared::Daemon;
use super::worker;

/// Longest time between two looks at the lease.
const LEASE_CHECK: Duration = Duration::from_millis(200);

/// Serves the queue until the daemon ends.
pub async fn serve(daemon: Arc<Daemon>) {
    let mut changes = daemon.changes();
    loop {
        if let Some(id) = next(&daemon) {
            begin(&daemon, id);
        }
        let changed = tokio::time::timeout(LEASE_CHECK, changes.changed()).await;
        if matches!(changed, Ok(Err(_))) {
            return;
        }
    }
}

/// The command whose turn begins now; without one, no task is woken.
fn next(daemon: &Daemon) -> Option<u64> {
    let is_idle =
        daemon.read(|schedule| schedule.lease().is_none() && schedule.open().next().is_none());
    if is_idle {
        return None;
    }
    daemon.change_quietly(|schedule, now| schedule.advance(|| Secret::random().ok(), now))
}

/// Starts the process of a command. An attached one waits for this moment itself.
fn begin(daemon: &Arc<Daemon>, id: u64) {
    let entry = daemon.read(|schedule| schedule.entry(id).cloned());
    let Ok(entry) = entry else { return };
    tracing::info!(
        run = id,
        operator = entry.operator,
        "{} begins",
        entry.request.command.name()
    );
    let Carrier::Started { ticket } = entry.carrier else {
        return;
    };
    let daemon = Arc::clone(daemon);
    tokio::spawn(async move {
        let output = daemon.output(id);
        let stopped = stopped_before_its_run(&daemon, id);
        let ended = worker::run(&daemon, &entry.request, &ticket, &output, stopped).await;
        finish(
            &daemon,
            id,
            &ended.map_err(|error| error.to_string()),
            &output,
        );
    });
}

/// Waits until somebody stops a command whose run has not begun, or that has none: a calculation, or a run in its own process.
async fn stopped_before_its_run(daemon: &Daemon, id: u64) {
    let mut changes = daemon.changes();
    let is_stopped = |entry: &RunEntry| entry.is_stopped && entry.phase == Phase::Starting;
    while !daemon.read(|schedule| schedule.entry(id).is_ok_and(is_stopped)) {
        if changes.changed().await.is_err() {
            return;
        }
    }
}

/// Ends a command whose process has ended.
fn finish(daemon: &Daemon, id: u64, ended: &Result<i32, String>, output: &RunOutput) {
    daemon.change(|schedule, now| {
        let Ok(entry) = schedule.open_entry(id) else {
            return;
        };
        let noted = entry.outcome.take();
        entry.exit_code = ended.as_ref().ok().copied();
        let (outcome, message) = match (ended, noted) {
            (Ok(0 | 3), _) => (RunOutcome::Completed, None),
            (Ok(_), Some(noted @ (RunOutcome::Tripped | RunOutcome::Stopped))) => (noted, None),
            (Ok(_), None) if entry.is_stopped => (RunOutcome::Stopped, None),
            (Ok(_), _) => (RunOutcome::Failed, Some(output.last_errors(3))),
            (Err(why), _) => (
                RunOutcome::Failed,
                Some(format!(
                    "its process cannot be started: {why}; look at the log of the daemon"
                )),
            ),
        };
        schedule.finish(id, outcome, message, now);
    });
    daemon.owner.end_command();
}
