//! One command of this machine on its connection (see [`session_messages`](super::session_messages)).

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::extract::ws::{Message, WebSocket};
use tokio::sync::{mpsc, oneshot};
use tokio::time::{MissedTickBehavior, interval};

use super::catalogue::{Catalogue, RecordingInfo};
use super::hold::Hold;
use super::live::hub::LiveRun;
use super::owner::OwnerOrder;
use super::peer::Peer;
use super::run_entry::{Carrier, Phase, RunEntry};
use super::schedule::{EndedRun, NewEntry, Schedule, ScheduleError, StopKind};
use super::session_messages::{FromCommand, FromDaemon, OpenCommand};
use super::shared::Daemon;
use bench_base::progress::Progress;
use bench_experiment::{
    EndKind, Ending, ExperimentError, MotorError, PlannedRun, RemoteError, Run, RunError,
    RunReport, RunSummary, close,
};
use bench_rt::record::Origin;
use bench_rt::supervision::ArmLease;

/// Period of the progress reports.
const PROGRESS: Duration = Duration::from_millis(100);
/// A command that did not report for this time gets no progress reports, which would fill the buffer of its connection.
const SILENCE: Duration = Duration::from_secs(1);
/// Longest time in which a command takes a message.
const SEND: Duration = Duration::from_secs(1);

/// Serves a command until its connection closes. `peer` is the user of the connection.
pub async fn serve(daemon: Arc<Daemon>, socket: WebSocket, peer: Peer) {
    let _counted = daemon.count_session();
    let mut connection = Connection(Some(socket));
    let Some(FromCommand::Open(open)) = connection.receive().await else {
        return; // not a command of this version
    };
    let entered = enter(&daemon, &open, peer);
    let (id, is_attached) = match entered {
        Ok(entered) => entered,
        Err(error) => return connection.send(&refused(error.to_string())).await,
    };
    let mut session = Session {
        daemon,
        id,
        connection,
        is_own_user: peer.is_own_user(),
        open_run: None,
        outcome: EndKind::Failed,
    };
    if session.wait_for_turn().await {
        session.serve_runs().await;
    }
    session.complete_recording().await;
    session.end(is_attached);
}

/// Number of the entry, and whether it belongs to the connection.
fn enter(daemon: &Daemon, open: &OpenCommand, peer: Peer) -> Result<(u64, bool), ScheduleError> {
    if let Some(ticket) = &open.ticket {
        // The processes of the daemon run as its own user.
        if !peer.is_own_user() {
            return Err(ScheduleError::NoTicket);
        }
        let id = daemon.change(|schedule, _| {
            let id = schedule.by_ticket(ticket)?;
            schedule.open_entry(id)?.estimated_s = open.estimated_s;
            Ok(id)
        })?;
        return Ok((id, false));
    }
    let id = daemon.change(|schedule, now| {
        let new = NewEntry {
            request: open.request.clone(),
            carrier: Carrier::Attached,
            operator: open.operator.clone(),
            lease: None,
        };
        let id = schedule.enqueue(new, now)?;
        schedule.open_entry(id)?.estimated_s = open.estimated_s;
        Ok(id)
    })?;
    Ok((id, true))
}

/// A file of an order that the command of another user may not be able to read: neither that of the daemon's own configuration, nor in the
/// folder of its recordings.
fn foreign_file(daemon: &Daemon, order: &PlannedRun) -> Option<String> {
    let file = order.plan().ok()?.config.calibration.file?;
    let own = daemon.configuration().config.calibration.file.as_ref();
    let is_known = own == Some(&file) || is_in(Path::new(&file), &daemon.recordings);
    (!is_known).then_some(file)
}

/// Whether a file is in a folder, with all symbolic links followed.
fn is_in(file: &Path, folder: &Path) -> bool {
    let found = file.canonicalize();
    found.is_ok_and(|found| found.starts_with(folder))
}

fn refused(message: String) -> FromDaemon {
    FromDaemon::Refused(RemoteError::failed(message))
}

/// The connection; `None` after it was closed.
struct Connection(Option<WebSocket>);

impl Connection {
    /// The next message. `None` when the connection is closed or sends what is not a message; it is closed then.
    async fn receive(&mut self) -> Option<FromCommand> {
        loop {
            let received = self.0.as_mut()?.recv().await;
            match received {
                Some(Ok(Message::Text(text))) => match serde_json::from_str(&text) {
                    Ok(message) => return Some(message),
                    Err(error) => {
                        let why = format!(
                            "a message of the command cannot be read: {error}; use the same version of `bench` for the daemon and the command"
                        );
                        tracing::warn!("{why}");
                        self.send(&refused(why)).await;
                        self.0 = None;
                    }
                },
                Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                Some(Ok(Message::Binary(_) | Message::Close(_)) | Err(_)) | None => self.0 = None,
            }
        }
    }

    fn is_open(&self) -> bool {
        self.0.is_some()
    }

    async fn send(&mut self, message: &FromDaemon) {
        let Some(socket) = &mut self.0 else { return };
        let Ok(text) = serde_json::to_string(message) else {
            self.0 = None;
            return;
        };
        let sent = tokio::time::timeout(SEND, socket.send(Message::Text(text.into())));
        if !matches!(sent.await, Ok(Ok(()))) {
            self.0 = None;
        }
    }
}

/// A command in the queue.
struct Session {
    daemon: Arc<Daemon>,
    id: u64,
    connection: Connection,
    /// Whether the command runs as the user of the daemon.
    is_own_user: bool,
    /// The last run, whose recording is still open for results.
    open_run: Option<Run>,
    /// How the last run ended.
    outcome: EndKind,
}

impl Session {
    /// Waits for the turn; returns whether it has come.
    async fn wait_for_turn(&mut self) -> bool {
        let mut changes = self.daemon.changes();
        let mut sent_text = String::new();
        loop {
            let (phase, text) = self.daemon.read(|schedule| turn(schedule, self.id));
            match phase {
                Phase::Starting | Phase::Running | Phase::Analysing => {
                    self.connection.send(&FromDaemon::Granted).await;
                    return true;
                }
                Phase::Finished => {
                    self.connection.send(&refused(text)).await;
                    return false;
                }
                Phase::Queued | Phase::Held | Phase::WaitingForLease => {}
            }
            // A command that is next begins at once.
            let is_next = phase == Phase::Queued && text.is_empty();
            if sent_text != text && !is_next {
                self.connection
                    .send(&FromDaemon::Waiting(text.clone()))
                    .await;
                sent_text = text;
            }
            tokio::select! {
                changed = changes.changed() => if changed.is_err() { return false },
                message = self.connection.receive() => match message {
                    Some(FromCommand::Stop(kind)) => self.stop(kind),
                    Some(_) => {}
                    None => return false,
                },
            }
        }
    }

    /// Serves runs until the connection closes or the daemon shuts down.
    async fn serve_runs(&mut self) {
        let mut changes = self.daemon.changes();
        loop {
            let message = tokio::select! {
                message = self.connection.receive() => message,
                changed = changes.changed() => {
                    let ends = self.daemon.read(Schedule::is_shutting_down);
                    if changed.is_err() || ends { return } else { continue }
                }
            };
            let Some(message) = message else { return };
            match message {
                FromCommand::Run(order) => {
                    self.complete_recording().await;
                    self.run(*order).await;
                }
                FromCommand::Finish(results) => self.finish(results).await,
                FromCommand::Stop(kind) => self.stop(kind),
                FromCommand::Alive => {}
                FromCommand::Open(_) => return,
            }
        }
    }

    /// The operator stops the command at its terminal.
    fn stop(&self, kind: StopKind) {
        // A command that is not known any more has ended.
        let _ = self.daemon.change(|schedule, now| {
            let by = stopped_by(schedule.entry(self.id)?);
            schedule.stop(self.id, kind, &by, now)
        });
    }

    async fn run(&mut self, mut order: PlannedRun) {
        if !self.is_own_user {
            // The command fetches the recording from there.
            order.conditions.folder.clone_from(&self.daemon.recordings);
            if let Some(file) = foreign_file(&self.daemon, &order) {
                let message = format!(
                    "calibration.file is {file}, and the daemon, which runs as another user, reads no file for this command with its own rights; copy it into {}, or add --connect none",
                    self.daemon.recordings.display()
                );
                return self.connection.send(&refused(message)).await;
            }
        }
        let (warnings, warned) = mpsc::unbounded_channel();
        let (reply, replied) = oneshot::channel();
        let progress = Progress::new(order.kind.name());
        let ordered = order.clone();
        let plan = blocking(move || Ok(ordered.plan()?))
            .await
            .ok()
            .map(Arc::new);
        let live_run = LiveRun {
            number: u32::try_from(self.id).unwrap_or(u32::MAX),
            kind: order.kind,
        };
        let lease = Arc::<ArmLease>::default();
        let trips = self.daemon.owner.trips();
        let begun = self.daemon.change(|schedule, _| {
            schedule.begin_run(self.id, |entry| {
                self.daemon.set_plan(plan);
                self.daemon.live.set_run(live_run);
                entry.progress = Some(progress.clone());
                order.description = order.description.or(entry.description());
                let ends_with_client = entry.request.ends_with_client();
                self.daemon.owner.run(OwnerOrder {
                    command: self.id,
                    order,
                    stop: entry.stop.clone(),
                    lease: ends_with_client.then(|| Arc::clone(&lease)),
                    progress: progress.clone(),
                    warnings,
                    reply,
                });
            })
        });
        if let Err(error) = begun {
            if self.outcome != EndKind::Tripped {
                self.outcome = EndKind::Stopped;
            }
            return self.connection.send(&refused(error.to_string())).await;
        }
        let result = self.follow(replied, warned, &progress, &lease).await;
        self.daemon.set_plan(None);
        let now = self.daemon.owner.trips();
        self.report(result, (now != trips).then_some(now.1)).await;
    }

    /// Follows a run to its end, also when the connection closes.
    async fn follow(
        &mut self,
        mut reply: oneshot::Receiver<Result<Run, ExperimentError>>,
        mut warnings: mpsc::UnboundedReceiver<String>,
        progress: &Progress,
        lease: &ArmLease,
    ) -> Result<Run, ExperimentError> {
        let mut reported = Instant::now();
        let mut ticks = interval(PROGRESS);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            let is_connected = self.connection.is_open();
            tokio::select! {
                result = &mut reply => {
                    while let Ok(text) = warnings.try_recv() {
                        self.connection.send(&FromDaemon::Warning(text)).await;
                    }
                    return result.unwrap_or_else(|_| Err(owner_ended()));
                }
                Some(text) = warnings.recv() => {
                    self.connection.send(&FromDaemon::Warning(text)).await;
                }
                _ = ticks.tick(), if reported.elapsed() < SILENCE => {
                    let now = progress.snapshot();
                    let message = FromDaemon::Progress { done: now.done, total: now.total };
                    self.connection.send(&message).await;
                }
                message = self.connection.receive(), if is_connected => match message {
                    Some(FromCommand::Alive) => {
                        lease.renew();
                        reported = Instant::now();
                    }
                    Some(FromCommand::Stop(kind)) => self.stop(kind),
                    Some(_) => {}
                    None => self.daemon.change(|schedule, now| schedule.lose_client(self.id, now)),
                },
            }
        }
    }

    /// Notes how a run ended, and reports it. `trip` is the reason of an interlock.
    async fn report(&mut self, result: Result<Run, ExperimentError>, trip: Option<&'static str>) {
        self.note_end(&result, trip);
        let message = match result {
            Ok(run) => self.completed(run).await,
            Err(error) => FromDaemon::Refused(RemoteError::from(&error)),
        };
        self.connection.send(&message).await;
    }

    /// Completes the ticks of a recording, which stays open for results.
    async fn completed(&mut self, run: Run) -> FromDaemon {
        match blocking(move || reported(run)).await {
            Ok((run, report)) => {
                self.open_run = Some(run);
                FromDaemon::Ended(Box::new(report))
            }
            Err(error) => {
                self.outcome = EndKind::Failed;
                self.note_failure(&error);
                FromDaemon::Refused(RemoteError::from(&error))
            }
        }
    }

    /// Notes the end of a run in the queue, before anything else: a trip holds the bench.
    fn note_end(&mut self, result: &Result<Run, ExperimentError>, trip: Option<&'static str>) {
        let run = result.as_ref().ok();
        self.outcome = outcome(result);
        let file = run.and_then(|run| run.path.file_name());
        let ended = EndedRun {
            outcome: self.outcome,
            recording: file.map(|name| name.to_string_lossy().into_owned()),
            message: result.as_ref().err().map(ToString::to_string),
            tripped_by: trip.map(|reason| format!("the interlock {reason}")),
        };
        let is_hung = run.is_some_and(|run| run.end.servo.stopped_by == Some(Origin::Lease));
        self.daemon.change(|schedule, now| {
            schedule.end_run(self.id, ended, now);
            if is_hung {
                schedule.lose_client(self.id, now);
            }
        });
    }

    /// Notes that the recording of a run cannot be completed.
    fn note_failure(&self, error: &ExperimentError) {
        let message = error.to_string();
        self.daemon.change(|schedule, _| {
            // An entry that has ended needs no notes.
            if let Ok(entry) = schedule.open_entry(self.id) {
                entry.outcome = Some(EndKind::Failed);
                entry.message = Some(message);
            }
        });
    }

    /// Adds the results of the command to the recording.
    async fn finish(&mut self, results: String) {
        let Some(run) = self.open_run.take() else {
            return self
                .connection
                .send(&FromDaemon::NotFinished(
                    "there is no open recording".into(),
                ))
                .await;
        };
        if let Some(verdict) = verdict(&results) {
            self.daemon.count_verdict(&verdict);
        }
        store_info(self.info(&run, &results)).await;
        let finished = blocking(move || run.finish(&results).map_err(ExperimentError::from)).await;
        let message = match finished {
            Ok(totals) => FromDaemon::Finished(totals),
            Err(error) => FromDaemon::NotFinished(error.to_string()),
        };
        self.connection.send(&message).await;
    }

    /// Completes a recording to which the command added no results.
    async fn complete_recording(&mut self) {
        let Some(mut run) = self.open_run.take() else {
            return;
        };
        store_info(self.info(&run, "")).await;
        let completed = blocking(move || {
            let summary = RunSummary::of(&mut run)?;
            close(run, &summary)
        });
        if let Err(error) = completed.await {
            tracing::warn!("{error}");
        }
    }

    /// What is known about a recording; `None` if it is not in the folder of the daemon.
    fn info(&self, run: &Run, results: &str) -> Option<KnownInfo> {
        let folder = run.path.parent();
        if folder != Some(self.daemon.recordings.as_path()) {
            return None;
        }
        let file = run.path.file_name()?.to_str()?;
        let entry = self
            .daemon
            .read(|schedule| schedule.entry(self.id).cloned());
        let info = RecordingInfo {
            command: entry.ok()?.request.order.command().name().into(),
            operator: run.end.description.operator.clone().unwrap_or_default(),
            name: run.end.description.name.clone().unwrap_or_default(),
            note: run.end.description.note.clone().unwrap_or_default(),
            outcome: Some(Ending::from(&run.end.servo).name().into()),
            verdict: verdict(results),
        };
        Some(KnownInfo {
            catalogue: self.daemon.catalogue(),
            file: file.into(),
            info,
        })
    }

    /// The connection has closed. A command that the daemon started ends with its process.
    fn end(self, is_attached: bool) {
        let (id, outcome) = (self.id, self.outcome);
        if is_attached {
            self.daemon
                .change(|schedule, now| schedule.finish(id, outcome, None, now));
        }
    }
}

/// What is known about a recording of the daemon.
struct KnownInfo {
    catalogue: Catalogue,
    file: String,
    info: RecordingInfo,
}

impl KnownInfo {
    fn store(&self) -> Result<(), ExperimentError> {
        let stored = self.catalogue.set_info(&self.file, &self.info);
        stored.map_err(|error| {
            let file = &self.file;
            ExperimentError::Failed(format!("{file}: its note cannot be stored: {error}"))
        })
    }
}

/// Stores what is known about a recording, if it is in the folder of the daemon.
async fn store_info(known: Option<KnownInfo>) {
    let Some(known) = known else { return };
    if let Err(error) = blocking(move || known.store()).await {
        tracing::warn!("{error}");
    }
}

/// The phase of a command, and what it waits for.
fn turn(schedule: &Schedule, id: u64) -> (Phase, String) {
    let Ok(entry) = schedule.entry(id) else {
        return (
            Phase::Finished,
            "the command is not known any more; start it again".into(),
        );
    };
    let text = match entry.phase {
        Phase::Finished => entry.message.clone().unwrap_or_default(),
        Phase::WaitingForLease => {
            let holder = schedule
                .lease()
                .map_or("another operator", |lease| &lease.operator);
            in_use(&format!("waiting until {holder} releases the arm lease"))
        }
        Phase::Held => schedule.hold().map(Hold::notice).unwrap_or_default(),
        Phase::Queued | Phase::Starting | Phase::Running | Phase::Analysing => {
            let before = schedule.open().take_while(|other| other.id != id);
            let ahead: Vec<u64> = before.map(|other| other.id).collect();
            waiting_text(&ahead)
        }
    };
    (entry.phase, text)
}

/// The verdict in the results of a command.
fn verdict(results: &str) -> Option<String> {
    let results: serde_json::Value = serde_json::from_str(results).ok()?;
    Some(results.get("cnmp")?.as_str()?.into())
}

/// What a command waits for; empty if it is next.
fn waiting_text(ahead: &[u64]) -> String {
    match ahead {
        [] => String::new(),
        [one] => in_use(&format!("waiting for the end of run {one}")),
        [first, ..] => in_use(&format!(
            "waiting for the end of run {first} and of {} more",
            ahead.len() - 1
        )),
    }
}

fn in_use(why: &str) -> String {
    format!("the bench is in use: {why}")
}

/// Who stops a command at its terminal.
fn stopped_by(entry: &RunEntry) -> String {
    let command = entry.request.order.command().name();
    format!(
        "Ctrl-C or a signal to bench {command} by {}",
        entry.operator
    )
}

fn reported(mut run: Run) -> Result<(Run, RunReport), ExperimentError> {
    let report = RunReport::of(&mut run)?;
    Ok((run, report))
}

fn outcome(result: &Result<Run, ExperimentError>) -> EndKind {
    match result {
        Ok(run) => Ending::from(&run.end.servo).kind(),
        Err(
            ExperimentError::Run(RunError::StoppedBefore)
            | ExperimentError::Motor(MotorError::Stopped),
        ) => EndKind::Stopped,
        Err(_) => EndKind::Failed,
    }
}

fn owner_ended() -> ExperimentError {
    ExperimentError::Failed(
        "the thread that owns the rig has ended; restart the daemon and report this with its log"
            .into(),
    )
}

/// Work on files, outside the tasks that serve clients.
async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, ExperimentError> + Send + 'static,
) -> Result<T, ExperimentError> {
    let done = tokio::task::spawn_blocking(work).await;
    done.unwrap_or_else(|_| Err(owner_ended()))
}
