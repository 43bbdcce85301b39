//! A command of this machine as client of the daemon that owns the rig.

use std::fmt;
use std::io;
use std::os::unix::net::UnixStream as BlockingStream;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use futures_util::{SinkExt, StreamExt};
use tokio::net::UnixStream;
use tokio::runtime::Runtime;
use tokio::time::{Interval, MissedTickBehavior, interval};
use tokio_tungstenite::WebSocketStream;
use tokio_tungstenite::tungstenite::Message;

use super::http_client::{Ask, HttpError, Target, download, json};
use super::private_files::{folder_of, require_private_folder};
use super::run_entry::RunRequest;
use super::schedule::StopKind;
use super::session_messages::{FromCommand, FromDaemon, MAX_MESSAGE_BYTES, OpenCommand};
use super::socket::{TICKET_VARIABLE, default_socket, sockets};
use bench_base::progress::Progress;
use bench_experiment::{
    ErrorKind, ErrorObject, ExperimentError, PlannedRun, RemoteError, RemoteRecording, RigOwner,
    RunReport, Stage, StopSignals,
};
use bench_recording::{RecordingError, Totals};
use bench_rt::thread::Pace;

/// Longest time between two renewals of the arm lease of a run.
const RENEWAL: Duration = Duration::from_millis(250);
/// Renewals in the time of an arm lease.
const RENEWALS_PER_LEASE: f64 = 8.0;

/// The path of the session on the socket.
pub const SESSION_PATH: &str = "/api/v1/session";

/// The socket of a daemon that runs on this machine.
pub fn running_daemon() -> Option<PathBuf> {
    sockets()
        .into_iter()
        .filter(is_trustworthy)
        .find(|path| BlockingStream::connect(path).is_ok())
}

/// Whether nobody else can have made a socket that was found by its default path. In a folder for temporary files another user may be
/// first.
fn is_trustworthy(socket: &PathBuf) -> bool {
    if *socket != default_socket() || !socket.exists() {
        return true;
    }
    match require_private_folder(folder_of(socket)) {
        Ok(()) => true,
        Err(error) => {
            let socket = socket.display();
            tracing::warn!("no daemon is used at {socket}: {error}");
            false
        }
    }
}

/// Whether the daemon started this process to carry out a command.
pub fn is_started_by_daemon() -> bool {
    std::env::var_os(TICKET_VARIABLE).is_some()
}

/// The kind of rig that the daemon of a socket has.
///
/// # Errors
/// When no daemon answers.
pub fn rig_of(socket: &Path) -> Result<Stage, HttpError> {
    let runtime = runtime()?;
    let target = Target::Socket(socket.into());
    let (_, state) = runtime.block_on(json(&target, &Ask::get("/api/v1/state")))?;
    match state["daemon"]["rig"].as_str() {
        Some("devices") => Ok(Stage::Devices),
        Some("simulated") => Ok(Stage::Simulated),
        _ => Err(io::Error::other("it is not a daemon of this version").into()),
    }
}

fn runtime() -> io::Result<Runtime> {
    tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build()
}

/// The daemon of a socket as owner of the rig. The connection opens with the first run and closes when the command ends.
pub struct DaemonOwner {
    socket: PathBuf,
    request: RunRequest,
    operator: String,
    connection: Mutex<Option<Arc<Mutex<Connection>>>>,
}

impl fmt::Debug for DaemonOwner {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "DaemonOwner({})", self.socket.display())
    }
}

impl DaemonOwner {
    /// The daemon of `socket`, for a command.
    pub fn new(socket: PathBuf, request: RunRequest, operator: String) -> DaemonOwner {
        DaemonOwner {
            socket,
            request,
            operator,
            connection: Mutex::new(None),
        }
    }

    /// The connection with its turn.
    fn connection(
        &self,
        order: &PlannedRun,
        progress: &Progress,
    ) -> Result<Arc<Mutex<Connection>>, ExperimentError> {
        let mut open = lock(&self.connection);
        if let Some(connection) = &*open {
            return Ok(Arc::clone(connection));
        }
        let mut connection = Connection::open(&self.socket)
            .map_err(|error| lost(&self.socket, &error.to_string()))?;
        connection.enter(self.opening(order), progress)?;
        let connection = Arc::new(Mutex::new(connection));
        *open = Some(Arc::clone(&connection));
        Ok(connection)
    }

    fn opening(&self, order: &PlannedRun) -> OpenCommand {
        OpenCommand {
            request: self.request.clone(),
            operator: self.operator.clone(),
            ticket: std::env::var(TICKET_VARIABLE).ok(),
            estimated_s: estimated_s(order),
        }
    }
}

/// Length of a run in real time, by its plan.
fn estimated_s(order: &PlannedRun) -> Option<f64> {
    if order.conditions.pace == Pace::Virtual {
        return None;
    }
    let plan = order.plan().ok()?;
    let ticks = plan.program().ok()?.ticks();
    Some(ticks as f64 * plan.config.servo.period_s())
}

impl RigOwner for DaemonOwner {
    fn run(
        &self,
        order: &PlannedRun,
        progress: &Progress,
    ) -> Result<(RunReport, Box<dyn RemoteRecording>), ExperimentError> {
        require_text(&order.conditions.folder)?;
        let connection = self.connection(order, progress)?;
        let report = lock(&connection).run(order, progress)?;
        let recording = DaemonRecording {
            connection,
            copy: Copy::of(&report, order, &self.socket),
        };
        recording.fetch()?;
        Ok((report, Box::new(recording)))
    }
}

/// The recording of the last run.
struct DaemonRecording {
    connection: Arc<Mutex<Connection>>,
    /// What is copied from the folder of the daemon; `None` if the daemon writes into the folder of the command.
    copy: Option<Copy>,
}

impl DaemonRecording {
    /// Copies the recording from the folder of the daemon, if it is there.
    fn fetch(&self) -> Result<(), ExperimentError> {
        let Some(copy) = &self.copy else {
            return Ok(());
        };
        copy.make().map_err(|error| {
            RemoteError::failed(format!(
                "the recording cannot be copied to {}: {error}; download {} from the daemon",
                copy.to.display(),
                copy.file
            ))
            .into()
        })
    }
}

/// A recording in the folder of the daemon, and its copy.
struct Copy {
    socket: PathBuf,
    file: String,
    to: PathBuf,
}

impl Copy {
    /// The copy of a run; `None` if its recording is in the ordered folder.
    fn of(report: &RunReport, order: &PlannedRun, socket: &Path) -> Option<Copy> {
        let made = report.path();
        let file = made.file_name()?.to_str()?;
        (made.parent() != Some(&order.conditions.folder)).then(|| Copy {
            socket: socket.into(),
            file: file.into(),
            to: order.conditions.folder.join(file),
        })
    }

    fn make(&self) -> Result<(), HttpError> {
        let target = Target::Socket(self.socket.clone());
        let path = format!("/api/v1/recordings/{}", self.file);
        let bytes = runtime()?.block_on(download(&target, &path))?;
        if let Some(folder) = self.to.parent() {
            std::fs::create_dir_all(folder)?;
        }
        Ok(std::fs::write(&self.to, bytes)?)
    }
}

impl RemoteRecording for DaemonRecording {
    fn finish(self: Box<Self>, results_json: &str) -> Result<Totals, RecordingError> {
        let finished = lock(&self.connection).finish(results_json);
        let copied = finished.and_then(|totals| self.fetch().map(|()| totals));
        copied.map_err(|error| RecordingError::Remote(error.to_string()))
    }
}

/// A connection to the daemon, used from a program without tasks.
struct Connection {
    runtime: Runtime,
    socket: PathBuf,
    stream: WebSocketStream<UnixStream>,
    /// When the arm lease of the run is renewed.
    renewals: Interval,
}

/// Period of the renewals of the arm lease of a run.
fn renewal_period(order: &PlannedRun) -> Duration {
    let lease_s = order
        .plan()
        .map_or(f64::INFINITY, |plan| plan.config.servo.arm_lease_s());
    let period = Duration::try_from_secs_f64(lease_s / RENEWALS_PER_LEASE);
    period.map_or(RENEWAL, |period| period.min(RENEWAL))
}

/// Renewals from now on. Those that a suspended process has missed are not made up for.
fn renewals(period: Duration) -> Interval {
    let mut renewals = interval(period);
    renewals.set_missed_tick_behavior(MissedTickBehavior::Delay);
    renewals
}

impl Connection {
    fn open(socket: &Path) -> io::Result<Connection> {
        let runtime = runtime()?;
        let stream = runtime.block_on(async {
            let stream = UnixStream::connect(socket).await?;
            let request = format!("ws://localhost{SESSION_PATH}");
            let connected = tokio_tungstenite::client_async(request, stream).await;
            connected.map_err(io::Error::other)
        })?;
        let renewals = runtime.block_on(async { renewals(RENEWAL) });
        Ok(Connection {
            runtime,
            socket: socket.into(),
            stream: stream.0,
            renewals,
        })
    }

    /// Asks for a turn and waits for it.
    fn enter(&mut self, open: OpenCommand, progress: &Progress) -> Result<(), ExperimentError> {
        self.send(&FromCommand::Open(Box::new(open)))?;
        loop {
            match self.receive()? {
                FromDaemon::Granted => return Ok(()),
                FromDaemon::Refused(error) => return Err(error.into()),
                FromDaemon::Waiting(text) => {
                    progress.begin("waiting for the bench", 0);
                    tracing::warn!("{text}");
                }
                other => return Err(self.unexpected(&other)),
            }
        }
    }

    fn run(
        &mut self,
        order: &PlannedRun,
        progress: &Progress,
    ) -> Result<RunReport, ExperimentError> {
        let period = renewal_period(order);
        self.renewals = self.runtime.block_on(async { renewals(period) });
        self.send(&FromCommand::Run(Box::new(order.clone())))?;
        loop {
            match self.receive()? {
                FromDaemon::Ended(report) => return Ok(*report),
                FromDaemon::Refused(error) => return Err(error.into()),
                FromDaemon::Warning(text) => tracing::warn!("{text}"),
                FromDaemon::Progress { done, total } => progress.set(done, total),
                other => return Err(self.unexpected(&other)),
            }
        }
    }

    fn finish(&mut self, results_json: &str) -> Result<Totals, ExperimentError> {
        self.send(&FromCommand::Finish(results_json.into()))?;
        match self.receive()? {
            FromDaemon::Finished(totals) => Ok(totals),
            FromDaemon::NotFinished(message) => Err(RemoteError::failed(message).into()),
            other => Err(self.unexpected(&other)),
        }
    }

    fn send(&mut self, message: &FromCommand) -> Result<(), ExperimentError> {
        let text = serde_json::to_string(message)
            .map_err(|error| lost(&self.socket, &error.to_string()))?;
        require_size(&text)?;
        let sent = self.runtime.block_on(self.stream.send(Message::text(text)));
        sent.map_err(|error| lost(&self.socket, &error.to_string()))
    }

    /// The next message. Meanwhile the arm lease is renewed: here and not in a thread of its own, so that a process that hangs renews
    /// nothing. Stop signals are sent on to the daemon: the first one settles the run, the second one cuts the current.
    fn receive(&mut self) -> Result<FromDaemon, ExperimentError> {
        let (stream, socket) = (&mut self.stream, &self.socket);
        let renewals = &mut self.renewals;
        let received = self.runtime.block_on(async {
            let mut signals = StopSignals::listen().map_err(|error| error.to_string())?;
            let mut kind = StopKind::Settle;
            loop {
                tokio::select! {
                    message = stream.next() => match message {
                        Some(Ok(Message::Text(text))) => return Ok(text),
                        Some(Ok(Message::Ping(_) | Message::Pong(_))) => {}
                        Some(Ok(_)) | None => return Err("the daemon has ended".to_string()),
                        Some(Err(error)) => return Err(error.to_string()),
                    },
                    () = signals.received() => {
                        send_to(stream, &FromCommand::Stop(kind)).await?;
                        kind = StopKind::Cut;
                    }
                    _ = renewals.tick() => send_to(stream, &FromCommand::Alive).await?,
                }
            }
        });
        let text = received.map_err(|why| lost(socket, &why))?;
        serde_json::from_str(&text).map_err(|error| lost(socket, &error.to_string()))
    }

    fn unexpected(&self, message: &FromDaemon) -> ExperimentError {
        lost(&self.socket, &format!("unexpected message {message:?}"))
    }
}

async fn send_to(
    stream: &mut WebSocketStream<UnixStream>,
    message: &FromCommand,
) -> Result<(), String> {
    let text = serde_json::to_string(message).map_err(|error| error.to_string())?;
    let sent = stream.send(Message::text(text)).await;
    sent.map_err(|error| error.to_string())
}

/// An order is sent as JSON, which contains text only.
fn require_text(folder: &Path) -> Result<(), RemoteError> {
    if folder.to_str().is_some() {
        return Ok(());
    }
    let message = format!(
        "--out: the name of the folder {} is not UTF-8, so that the daemon cannot write there; choose another folder, or add --connect none",
        folder.display()
    );
    Err(RemoteError {
        error: ErrorObject::new(message, ErrorKind::Usage, Some("--out".into())),
        is_failure: false,
    })
}

/// The daemon closes the connection of a command that sends more.
fn require_size(message: &str) -> Result<(), RemoteError> {
    if message.len() <= MAX_MESSAGE_BYTES {
        return Ok(());
    }
    Err(RemoteError::failed(format!(
        "what the command sends to the daemon has {} bytes, and the daemon takes at most {MAX_MESSAGE_BYTES}; shorten the reference, or add --connect none",
        message.len()
    )))
}

fn lost(socket: &Path, why: &str) -> ExperimentError {
    let socket = socket.display();
    RemoteError::failed(format!(
        "the connection to the daemon at {socket} was lost ({why}); look at its log, or add --connect none to run without it"
    ))
    .into()
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
