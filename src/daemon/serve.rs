//! Start, listeners, and shutdown of the daemon.

use std::fs::Permissions;
use std::io;
use std::net::SocketAddr;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::middleware;
use sd_notify::NotifyState;
use tokio::net::{TcpListener, UnixListener};

use super::api::guard::{Guard, guard};
use super::api::{Reach, router};
use super::connections::{serve_tcp, serve_unix};
use super::dispatch;
use super::live::hub::{LiveHub, Viewer};
use super::owner::Owner;
use super::run_entry::{Carrier, Command, OnDisconnect, RunRequest};
use super::run_record::{LastEnd, RunRecord, recover_cut_recordings};
use super::schedule::{NewEntry, StopKind};
use super::secret::Secret;
use super::shared::{Daemon, DaemonConfig, Parts};
use crate::experiment::{FeedSender, StopSignals};
use crate::util::atomic_file::write_atomic;

/// Longest time in which a run ends after a signal; then the loop is closed, which disables the amplifier.
const SHUTDOWN: Duration = Duration::from_secs(8);
/// Longest time without a tick for which the watchdog is still notified, because the devices are being opened.
const OPENING: Duration = Duration::from_secs(15);
/// Permissions of the socket: its owner and its group.
const SOCKET_MODE: u32 = 0o660;

/// What the daemon is started with.
#[derive(Clone, Debug)]
pub struct ServeOptions {
    /// The configuration.
    pub configuration: DaemonConfig,
    /// The socket.
    pub socket: PathBuf,
    /// An address for TCP.
    pub listen: Option<SocketAddr>,
    /// An address for Foxglove and Lichtblick. Only with the feature `foxglove`.
    pub foxglove: Option<SocketAddr>,
    /// Folder of the recordings.
    pub recordings: PathBuf,
    /// Whether a closed loop begins at once, on the simulated stage.
    pub demo: bool,
}

/// A daemon that cannot start.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// Another daemon has the socket.
    #[error("a daemon runs already at {}; stop it first, or choose another path with --socket", .0.display())]
    Running(PathBuf),
    /// The socket cannot be made.
    #[error("cannot listen at {}: {why}; choose another path with --socket", path.display())]
    Socket {
        /// The path.
        path: PathBuf,
        /// The error of the operating system.
        why: io::Error,
    },
    /// The address cannot be used.
    #[error("cannot listen at {address}: {why}; choose another address with --listen")]
    Address {
        /// The address.
        address: SocketAddr,
        /// The error of the operating system.
        why: io::Error,
    },
    /// The folder cannot be used.
    #[error("cannot write to the folder {}: {why}; choose another one with --out", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The error of the operating system.
        why: io::Error,
    },
    /// The address for viewers cannot be used.
    #[error("cannot listen at {address}: {why}; choose another address with --foxglove")]
    Foxglove {
        /// The address.
        address: SocketAddr,
        /// Why.
        why: String,
    },
    /// The program was built without the server for viewers.
    #[error(
        "this program was built without --foxglove; install the Debian package, or build with `--features foxglove`"
    )]
    WithoutFoxglove,
    /// The system refuses threads or random numbers.
    #[error("cannot start the daemon: {0}; look at the limits of the system")]
    System(String),
}

/// Runs the daemon until a signal ends it. `started` is called when clients can connect, with the address of the page.
///
/// # Errors
/// When the daemon cannot start.
pub fn serve(options: ServeOptions, started: impl FnOnce(&Started)) -> Result<(), ServeError> {
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .map_err(|error| ServeError::System(error.to_string()))?;
    let served = runtime.block_on(serve_clients(options, started));
    // Tasks of clients that do not end are not waited for.
    runtime.shutdown_timeout(Duration::from_millis(200));
    served
}

/// Where the daemon can be reached.
#[derive(Clone, Debug)]
pub struct Started {
    /// The socket.
    pub socket: PathBuf,
    /// The address of the page with the token.
    pub page: Option<String>,
    /// The address for Foxglove and Lichtblick.
    pub foxglove: Option<SocketAddr>,
    /// The file with the token.
    pub token_file: Option<PathBuf>,
    /// Why the daemon started.
    pub reason: String,
}

async fn serve_clients(
    options: ServeOptions,
    started: impl FnOnce(&Started),
) -> Result<(), ServeError> {
    let folder_error = |why| ServeError::Folder {
        path: options.recordings.clone(),
        why,
    };
    std::fs::create_dir_all(&options.recordings).map_err(folder_error)?;
    let recordings = options.recordings.canonicalize().map_err(folder_error)?;
    let unix = listen_unix(&options.socket)?;
    let (record, last) = RunRecord::begin(&recordings).map_err(folder_error)?;
    let reason = start_reason(last, &recordings);
    let tcp = match options.listen {
        Some(address) => Some(listen_tcp(address).await?),
        None => None,
    };
    let (token, token_file) = token(&options)?;
    let mut signals =
        StopSignals::listen().map_err(|error| ServeError::System(error.to_string()))?;
    let (viewer, foxglove) = start_viewer(options.foxglove).await?.unzip();
    let daemon = start_daemon(&options, &recordings, reason.clone(), viewer)?;
    let tasks = spawn_tasks(&daemon, unix, tcp.as_ref(), token.as_ref())?;
    if options.demo {
        start_demo(&daemon);
    }
    let page = tcp
        .as_ref()
        .map(|listener| page_address(listener, token.as_ref()));
    started(&Started {
        socket: options.socket.clone(),
        page,
        foxglove,
        token_file: token_file.clone(),
        reason,
    });
    tracing::info!(socket = %options.socket.display(), tcp = ?options.listen, "the daemon runs");
    notify(&[NotifyState::Ready]);
    signals.received().await;
    notify(&[NotifyState::Stopping]);
    shut_down(&daemon, &mut signals).await;
    tasks.abort_all_clients();
    drop(daemon);
    for path in [Some(options.socket), token_file].into_iter().flatten() {
        let _ = std::fs::remove_file(path); // it may have been removed by hand
    }
    drop(record);
    Ok(())
}

/// The server for Foxglove and Lichtblick, with its address.
#[cfg(feature = "foxglove")]
async fn start_viewer(
    address: Option<SocketAddr>,
) -> Result<Option<(Box<dyn Viewer>, SocketAddr)>, ServeError> {
    let Some(address) = address else {
        return Ok(None);
    };
    let server = super::foxglove::FoxgloveServer::start(address).await;
    let server = server.map_err(|error| ServeError::Foxglove {
        address,
        why: error.to_string(),
    })?;
    let address = server.address();
    Ok(Some((Box::new(server), address)))
}

/// Without the feature there is no server.
#[cfg(not(feature = "foxglove"))]
async fn start_viewer(
    address: Option<SocketAddr>,
) -> Result<Option<(Box<dyn Viewer>, SocketAddr)>, ServeError> {
    match address {
        None => Ok(None),
        Some(_) => Err(ServeError::WithoutFoxglove),
    }
}

/// The threads of the rig and of the live view.
fn start_daemon(
    options: &ServeOptions,
    recordings: &Path,
    start_reason: String,
    viewer: Option<Box<dyn Viewer>>,
) -> Result<Arc<Daemon>, ServeError> {
    let system = |error: io::Error| ServeError::System(error.to_string());
    let config = options.configuration.config.clone();
    let (sender, feeds) = FeedSender::channel();
    let live = LiveHub::start(&config, feeds, sender.clone(), viewer).map_err(system)?;
    let owner = Owner::start(config, sender).map_err(system)?;
    Ok(Arc::new(Daemon::new(Parts {
        owner,
        live,
        configuration: options.configuration.clone(),
        recordings: recordings.into(),
        socket: std::path::absolute(&options.socket).map_err(system)?,
        start_reason,
    })))
}

/// A socket that only its owner and its group may use. A socket without a daemon is replaced.
fn listen_unix(path: &Path) -> Result<UnixListener, ServeError> {
    let failed = |why| ServeError::Socket {
        path: path.into(),
        why,
    };
    if std::os::unix::net::UnixStream::connect(path).is_ok() {
        return Err(ServeError::Running(path.into()));
    }
    if let Some(folder) = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
    {
        create_private_folder(folder).map_err(failed)?;
    }
    match std::fs::symlink_metadata(path) {
        Ok(found) if std::os::unix::fs::FileTypeExt::is_socket(&found.file_type()) => {
            std::fs::remove_file(path).map_err(failed)?;
        }
        Ok(_) => return Err(failed(io::ErrorKind::AlreadyExists.into())),
        Err(_) => {}
    }
    let listener = UnixListener::bind(path).map_err(failed)?;
    std::fs::set_permissions(path, Permissions::from_mode(SOCKET_MODE)).map_err(failed)?;
    Ok(listener)
}

/// A folder that only this user may enter. One that exists is left as it is.
fn create_private_folder(folder: &Path) -> io::Result<()> {
    use std::os::unix::fs::DirBuilderExt;
    if folder.is_dir() {
        return Ok(());
    }
    std::fs::DirBuilder::new()
        .recursive(true)
        .mode(0o700)
        .create(folder)
}

async fn listen_tcp(address: SocketAddr) -> Result<TcpListener, ServeError> {
    let listener = TcpListener::bind(address).await;
    listener.map_err(|why| ServeError::Address { address, why })
}

/// The token of this start, in a file that only this user may read. Without TCP there is none.
fn token(options: &ServeOptions) -> Result<(Option<Secret>, Option<PathBuf>), ServeError> {
    if options.listen.is_none() {
        return Ok((None, None));
    }
    let system = |error: String| ServeError::System(error);
    let secret = Secret::random().map_err(|error| system(error.to_string()))?;
    let path = options.socket.with_extension("token");
    write_atomic(&path, secret.reveal()).map_err(|error| system(error.to_string()))?;
    let private = std::fs::set_permissions(&path, Permissions::from_mode(0o640));
    private.map_err(|error| system(error.to_string()))?;
    Ok((Some(secret), Some(path)))
}

fn page_address(listener: &TcpListener, token: Option<&Secret>) -> String {
    let address = listener
        .local_addr()
        .map_or(String::new(), |address| address.to_string());
    let token = token.map_or(String::new(), |token| format!("#token={}", token.reveal()));
    format!("http://{address}/{token}")
}

/// Why the daemon started; recovers what a crash has cut off.
fn start_reason(last: LastEnd, recordings: &Path) -> String {
    if last == LastEnd::Clean {
        return "started".into();
    }
    let copies = recover_cut_recordings(recordings);
    let recovered = match copies.len() {
        0 => "no recording was cut off".to_string(),
        _ => format!("recovered: {}", copies.join(", ")),
    };
    let reason = format!(
        "started after a crash: the daemon before this one ended without a shutdown; {recovered}"
    );
    tracing::warn!("{reason}");
    reason
}

/// The tasks of the daemon.
struct Tasks(Vec<tokio::task::JoinHandle<()>>);

impl Tasks {
    fn abort_all_clients(self) {
        for task in self.0 {
            task.abort();
        }
    }
}

fn spawn_tasks(
    daemon: &Arc<Daemon>,
    unix: UnixListener,
    tcp: Option<&TcpListener>,
    token: Option<&Secret>,
) -> Result<Tasks, ServeError> {
    let local = router(Arc::clone(daemon), Reach::Machine);
    let mut tasks = vec![
        tokio::spawn(dispatch::serve(Arc::clone(daemon))),
        tokio::spawn(watch_loop(Arc::clone(daemon))),
        tokio::spawn(serve_unix(unix, local)),
    ];
    if let (Some(listener), Some(token)) = (tcp, token) {
        tasks.push(spawn_tcp(daemon, listener, token)?);
    }
    Ok(Tasks(tasks))
}

fn spawn_tcp(
    daemon: &Arc<Daemon>,
    listener: &TcpListener,
    token: &Secret,
) -> Result<tokio::task::JoinHandle<()>, ServeError> {
    let system = |error: io::Error| ServeError::System(error.to_string());
    let address = listener.local_addr().map_err(system)?;
    let checks = Arc::new(Guard::new(token.clone(), address));
    let remote = router(Arc::clone(daemon), Reach::Network)
        .layer(middleware::from_fn_with_state(checks, guard));
    let own = std::os::fd::AsFd::as_fd(listener)
        .try_clone_to_owned()
        .map_err(system)?;
    let own = std::net::TcpListener::from(own);
    let listener = TcpListener::from_std(own).map_err(system)?;
    Ok(tokio::spawn(serve_tcp(listener, remote)))
}

/// Tells systemd that all is well, as long as ticks pass.
async fn watch_loop(daemon: Arc<Daemon>) {
    let period = sd_notify::watchdog_enabled().map_or(Duration::from_secs(1), |limit| limit / 4);
    let (mut ticks, mut passed) = (0, Instant::now());
    loop {
        tokio::time::sleep(period).await;
        let now = daemon.live.ticks();
        if now != ticks {
            (ticks, passed) = (now, Instant::now());
        }
        let status = daemon.owner.status();
        // While the devices are closed, no tick passes; the owner tries again to open them.
        let is_closed = status.fault.is_some() && status.names.is_none();
        let may_wait = is_closed || passed.elapsed() < OPENING && status.is_opening;
        if passed.elapsed() < 2 * period || may_wait {
            notify(&[NotifyState::Watchdog]);
        }
    }
}

fn notify(states: &[NotifyState<'_>]) {
    if let Err(error) = sd_notify::notify(states) {
        tracing::debug!("systemd was not notified: {error}");
    }
}

/// Settles the run and waits until it has ended; a second signal cuts the current.
async fn shut_down(daemon: &Daemon, signals: &mut StopSignals) {
    daemon.change(|schedule, now| schedule.shut_down(now));
    let mut changes = daemon.changes();
    let ended = async {
        while daemon.sessions() > 0 {
            tokio::select! {
                changed = changes.changed() => if changed.is_err() { return },
                () = signals.received() => {
                    daemon.change(|schedule, _| schedule.stop_current(StopKind::Cut));
                }
            }
        }
    };
    if tokio::time::timeout(SHUTDOWN, ended).await.is_err() {
        tracing::warn!("the run did not end in time; the rig is closed");
    }
}

/// Starts a closed loop with a step on the simulated stage, again and again.
fn start_demo(daemon: &Arc<Daemon>) {
    let args = [
        "--slow",
        "--reference",
        "sine",
        "--amplitude",
        "50um",
        "--frequency",
        "2Hz",
        "--duration",
        "3600s",
        "--pace",
        "realtime",
        // Missed ticks do no harm to a simulated stage, and the program may have no real-time priority.
        "--set",
        "interlock.overruns_per_s=5000",
    ];
    let ticket = Secret::random();
    let Ok(ticket) = ticket else { return };
    let new = NewEntry {
        request: RunRequest {
            command: Command::Control,
            args: args.map(String::from).to_vec(),
            name: "demonstration".into(),
            note: String::new(),
            on_disconnect: OnDisconnect::Continue,
        },
        carrier: Carrier::Started { ticket },
        operator: "demo".into(),
        lease: None,
    };
    if let Err(error) = daemon.change(|schedule, now| schedule.enqueue(new, now)) {
        tracing::warn!("the demonstration was not started: {error}");
    }
}
