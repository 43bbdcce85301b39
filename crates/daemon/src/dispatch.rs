//! Gives the commands of the queue their turn, one after the other.

use std::sync::Arc;
use std::time::Duration;

use super::output::RunOutput;
use super::run_entry::{Carrier, Phase};
use super::schedule::Schedule;
use super::secret::Secret;
use super::shared::Daemon;
use super::worker;
use bench_experiment::EndKind;

/// Longest time between two looks at the lease.
const LEASE_CHECK: Duration = Duration::from_millis(200);
/// Longest time in which a process completes its results after its turn.
const RESULTS: Duration = Duration::from_secs(60);

/// Serves the queue until the daemon ends.
pub async fn serve(daemon: Arc<Daemon>) {
    let mut changes = daemon.changes();
    let mut last = None;
    loop {
        let begun = next(&daemon);
        let current = daemon.read(|schedule| schedule.current().map(|entry| entry.id));
        if let Some(ended) = last.filter(|_| last != current) {
            daemon.owner.end_command(ended);
        }
        last = current;
        if let Some(id) = begun {
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
        entry.request.order.command().name()
    );
    let Carrier::Started { ticket } = entry.carrier else {
        return;
    };
    daemon.change(|schedule, _| {
        if let Ok(entry) = schedule.open_entry(id) {
            entry.has_process = true;
        }
    });
    let daemon = Arc::clone(daemon);
    tokio::spawn(async move {
        let output = daemon.output(id);
        let stopped = process_must_end(&daemon, id);
        let ended = worker::run(&daemon, &entry.request.order, &ticket, &output, stopped).await;
        finish(
            &daemon,
            id,
            &ended.map_err(|error| error.to_string()),
            &output,
        );
    });
}

/// Waits until the process of a command must end: somebody stopped it before its run, or it has no run (a calculation, or a run in its
/// own process). One that still works on its results after its turn has some time for them.
async fn process_must_end(daemon: &Daemon, id: u64) {
    let mut changes = daemon.changes();
    loop {
        match daemon.read(|schedule| work(schedule, id)) {
            Work::MayGoOn => {}
            Work::Stopped => return,
            Work::AfterItsTurn => return tokio::time::sleep(RESULTS).await,
        }
        if changes.changed().await.is_err() {
            return;
        }
    }
}

/// What the process of a command may do.
enum Work {
    MayGoOn,
    Stopped,
    /// Its turn has ended.
    AfterItsTurn,
}

fn work(schedule: &Schedule, id: u64) -> Work {
    match schedule.open().find(|entry| entry.id == id) {
        None => Work::AfterItsTurn,
        Some(entry) if entry.is_stopped && entry.phase == Phase::Starting => Work::Stopped,
        Some(_) => Work::MayGoOn,
    }
}

/// Ends a command whose process has ended.
fn finish(daemon: &Daemon, id: u64, ended: &Result<i32, String>, output: &RunOutput) {
    daemon.change(|schedule, now| {
        schedule.end_process(id, ended.as_ref().ok().copied());
        let Ok(entry) = schedule.open_entry(id) else {
            return; // its turn has ended before
        };
        let noted = entry.outcome.take();
        let (outcome, message) = match (ended, noted) {
            (Ok(0 | 3), _) => (EndKind::Completed, None),
            (Ok(_), Some(noted @ (EndKind::Tripped | EndKind::Stopped))) => (noted, None),
            (Ok(_), None) if entry.is_stopped => (EndKind::Stopped, None),
            (Ok(_), _) => (EndKind::Failed, Some(output.last_errors(3))),
            (Err(why), _) => (
                EndKind::Failed,
                Some(format!(
                    "its process cannot be started: {why}; look at the log of the daemon"
                )),
            ),
        };
        schedule.finish(id, outcome, message, now);
    });
}
