//! Start, listeners, and shutdown of the daemon.

use std::io;
use std::net::SocketAddr;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use axum::middleware;
use sd_notify::NotifyState;
use serde_json::json;
use tokio::net::{TcpListener, UnixListener};

use super::api::guard::{Guard, guard};
use super::api::{Reach, router};
use super::connections::{serve_tcp, serve_unix};
use super::descriptors::Capacity;
use super::dispatch;
use super::files::STACK_BYTES;
use super::heap;
use super::live::hub::{LiveHub, Viewer};
use super::owner::Owner;
use super::ownership::Ownership;
use super::run_entry::{Carrier, OnDisconnect, RunRequest};
use super::run_record::{LastEnd, recover_cut_recordings};
use super::schedule::{NewEntry, StopKind};
use super::secret::Secret;
use super::shared::{Daemon, Parts};
use super::start::{ServeError, ServeOptions, Started};
use bench_experiment::{FeedSender, StopSignals};
use bench_order::Order;

/// Longest time in which a run ends after a signal; then the loop is closed, which disables the amplifier.
const SHUTDOWN: Duration = Duration::from_secs(8);
/// Longest time without a tick for which the watchdog is still notified, because the devices are being opened.
const OPENING: Duration = Duration::from_secs(15);

/// Runs the daemon until a signal ends it. `started` is called when clients can connect, with the address of the page.
///
/// # Errors
/// When the daemon cannot start.
pub fn serve(options: ServeOptions, started: impl FnOnce(&Started)) -> Result<(), ServeError> {
    heap::configure();
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .thread_stack_size(STACK_BYTES)
        .enable_all()
        .build()
        .map_err(|error| ServeError::System(error.to_string()))?;
    let served = runtime.block_on(serve_clients(options, started));
    // Tasks of clients that do not end are not waited for.
    runtime.shutdown_timeout(Duration::from_millis(200));
    served
}

async fn serve_clients(
    options: ServeOptions,
    started: impl FnOnce(&Started),
) -> Result<(), ServeError> {
    let mut own = Ownership::take(&options)?;
    let unix = own.listen()?;
    let tcp = match options.listen {
        Some(address) => Some(listen_tcp(address).await?),
        None => None,
    };
    let token = tcp.as_ref().map(|_| new_token(&mut own)).transpose()?;
    let mut signals =
        StopSignals::listen().map_err(|error| ServeError::System(error.to_string()))?;
    let (viewer, foxglove) = start_viewer(options.foxglove).await?.unzip();
    let recordings = own.recordings().to_path_buf();
    let reason = start_reason(own.last_end(), &recordings);
    let daemon = start_daemon(&options, &recordings, reason.clone(), viewer)?;
    let tasks = spawn_tasks(&daemon, unix, tcp.as_ref(), token.as_ref())?;
    if options.demo {
        start_demo(&daemon);
    }
    own.started();
    started(&Started {
        socket: options.socket.clone(),
        page: tcp.as_ref().map(page_address),
        token,
        foxglove,
        token_file: own.token_file(),
        reason,
    });
    tracing::info!(socket = %options.socket.display(), tcp = ?options.listen, "the daemon runs");
    notify(&[NotifyState::Ready]);
    signals.received().await;
    notify(&[NotifyState::Stopping]);
    shut_down(&daemon, &mut signals).await;
    tasks.abort_all_clients();
    drop(daemon);
    drop(own);
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

async fn listen_tcp(address: SocketAddr) -> Result<TcpListener, ServeError> {
    let listener = TcpListener::bind(address).await;
    listener.map_err(|why| ServeError::Address { address, why })
}

/// The token of this start, also in a file that only this user may read.
fn new_token(own: &mut Ownership) -> Result<Secret, ServeError> {
    let token = Secret::random().map_err(|error| ServeError::System(error.to_string()))?;
    own.write_token(&token)?;
    Ok(token)
}

/// The address of the page, without the token.
fn page_address(listener: &TcpListener) -> String {
    let address = listener.local_addr();
    address.map_or(String::new(), |address| format!("http://{address}/"))
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
    let capacity = Capacity::of_process();
    let local = router(Arc::clone(daemon), Reach::Machine);
    let mut tasks = vec![
        tokio::spawn(dispatch::serve(Arc::clone(daemon))),
        tokio::spawn(watch_loop(Arc::clone(daemon))),
        tokio::spawn(serve_unix(unix, local, capacity)),
    ];
    if let (Some(listener), Some(token)) = (tcp, token) {
        tasks.push(spawn_tcp(daemon, listener, token, capacity)?);
    }
    Ok(Tasks(tasks))
}

fn spawn_tcp(
    daemon: &Arc<Daemon>,
    listener: &TcpListener,
    token: &Secret,
    capacity: Capacity,
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
    Ok(tokio::spawn(serve_tcp(listener, remote, capacity)))
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
                    daemon.change(|schedule, now| schedule.stop_current(StopKind::Cut, now));
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
    let order = json!({
        "command": "control",
        "slow": true,
        "reference": "sine",
        "amplitude": "50um",
        "frequency": "2Hz",
        "duration": "3600s",
        "pace": "realtime",
        // Missed ticks do no harm to a simulated stage, and the program may have no real-time priority.
        "set": ["interlock.overruns_per_s=5000"],
    });
    let ticket = Secret::random();
    let (Ok(ticket), Ok(order)) = (ticket, Order::from_json(order)) else {
        return;
    };
    let new = NewEntry {
        request: RunRequest {
            order,
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
