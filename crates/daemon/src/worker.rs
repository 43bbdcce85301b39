//! Commands as processes of their own: they send their plan to the owner of the rig and analyse the recording in their own memory.

use std::io;
use std::pin::pin;
use std::process::{ExitStatus, Output, Stdio};
use std::sync::Arc;
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tokio::io::{AsyncRead, AsyncReadExt};
use tokio::process::{Child, Command as Process};

use super::computations::{Busy, Purpose};
use super::output::{OutputPiece, RunOutput};
use super::secret::Secret;
use super::shared::Daemon;
use super::socket::{SOCKET_VARIABLE, TICKET_VARIABLE};
use bench_config::Source;
use bench_order::Order;

/// Longest time of a computation without motion.
const COMPUTATION: Duration = Duration::from_secs(60);
/// Longest time in which a stopped process ends by itself.
const END_TIME: Duration = Duration::from_secs(5);
/// Exit code of a command that was stopped before its process began.
const STOPPED: i32 = 1;

/// The program of the daemon itself, with the words of a command line.
fn process(daemon: &Daemon, words: &[String]) -> io::Result<Process> {
    let program = std::env::current_exe()?;
    let mut process = Process::new(program);
    process
        .args(words)
        .current_dir(&daemon.recordings)
        .env(SOCKET_VARIABLE, &daemon.socket)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .kill_on_drop(true);
    Ok(process)
}

/// The words of an order. The configuration of the daemon applies unless the order names another.
fn order_words(daemon: &Daemon, order: &Order) -> Vec<String> {
    let Source { config, sets, .. } = &daemon.configuration().source;
    let order = order.clone().on_bench(config.as_deref(), sets);
    let mut words = vec![order.command().name().to_string()];
    words.extend(order.arguments());
    words
}

/// Runs a command to its end, or ends its process when `stopped` is ready; returns its exit code.
///
/// # Errors
/// When the system refuses the process.
pub async fn run(
    daemon: &Daemon,
    order: &Order,
    ticket: &Secret,
    output: &Arc<RunOutput>,
    stopped: impl Future<Output = ()>,
) -> io::Result<i32> {
    let mut process = process(daemon, &order_words(daemon, order))?;
    process.env(TICKET_VARIABLE, ticket.reveal());
    match order {
        // Its results stand beside the recording.
        Order::Identify(_) => {}
        Order::Chirp(_)
        | Order::Control(_)
        | Order::Calibrate(_)
        | Order::Linearity(_)
        | Order::Campaign(_) => {
            process.arg("--out").arg(&daemon.recordings);
        }
    }
    let stopped = pin!(stopped);
    let Some((mut child, stopped)) = spawned(process, stopped).await? else {
        output.add(OutputPiece::Exit(STOPPED));
        return Ok(STOPPED);
    };
    let stdout = child
        .stdout
        .take()
        .map(|pipe| copy(pipe, OutputPiece::Stdout, output));
    let stderr = child
        .stderr
        .take()
        .map(|pipe| copy(pipe, OutputPiece::Stderr, output));
    let status = tokio::select! {
        status = child.wait() => status?,
        () = stopped => end(&mut child).await?,
    };
    for copied in [stdout, stderr].into_iter().flatten() {
        let _ = copied.await; // what was printed before the end
    }
    let code = status.code().unwrap_or(1);
    output.add(OutputPiece::Exit(code));
    Ok(code)
}

/// Starts a process, unless it is stopped before. The process enters the folder of the recordings: if the folder does not answer, its
/// start takes for ever.
async fn spawned<S: Future<Output = ()> + Unpin>(
    mut process: Process,
    mut stopped: S,
) -> io::Result<Option<(Child, S)>> {
    let child = tokio::task::spawn_blocking(move || process.spawn());
    tokio::select! {
        child = child => Ok(Some((child??, stopped))),
        () = &mut stopped => Ok(None), // a process that starts later is killed
    }
}

/// Asks a process to end, and kills it if it does not.
async fn end(child: &mut Child) -> io::Result<ExitStatus> {
    let number = child.id().and_then(|number| i32::try_from(number).ok());
    if let Some(number) = number {
        let _ = kill(Pid::from_raw(number), Signal::SIGTERM); // a process that has ended needs no signal
    }
    if let Ok(status) = tokio::time::timeout(END_TIME, child.wait()).await {
        return status;
    }
    child.kill().await?;
    child.wait().await
}

/// Copies a pipe into the output.
fn copy(
    mut pipe: impl AsyncRead + Unpin + Send + 'static,
    piece: fn(String) -> OutputPiece,
    output: &Arc<RunOutput>,
) -> tokio::task::JoinHandle<()> {
    let output = Arc::clone(output);
    tokio::spawn(async move {
        let mut buffer = vec![0; 16 << 10];
        while let Ok(bytes) = pipe.read(&mut buffer).await {
            if bytes == 0 {
                return;
            }
            output.add(piece(
                String::from_utf8_lossy(&buffer[..bytes]).into_owned(),
            ));
        }
    })
}

/// Why a computation has no result.
#[derive(Debug, thiserror::Error)]
pub enum ComputeError {
    /// The system refuses the process.
    #[error("the computation cannot be started: {0}; look at the limits of the daemon's processes")]
    Start(#[from] io::Error),
    /// Others go on.
    #[error(transparent)]
    Busy(#[from] Busy),
    /// It takes too long.
    #[error("the computation took more than {} s; start it on the command line", COMPUTATION.as_secs())]
    TooLong,
    /// It printed no object.
    #[error("the computation failed: {0}; start it on the command line for details")]
    NoResult(String),
}

/// What an order would do. It moves nothing.
///
/// # Errors
/// When the process cannot be started, takes too long, or prints no object.
pub async fn plan(daemon: &Daemon, order: Order) -> Result<serde_json::Value, ComputeError> {
    let mut words = order_words(daemon, &order.with_json());
    // In front of the recording of an analysis.
    words.insert(1, "--plan".into());
    object(daemon, Purpose::Plan, &words).await
}

/// What a command shows of the bench of the daemon (`doctor`, or `model modes`).
///
/// # Errors
/// When the process cannot be started, takes too long, or prints no object.
pub async fn view(
    daemon: &Daemon,
    purpose: Purpose,
    command: &[&str],
) -> Result<serde_json::Value, ComputeError> {
    let Source { config, sets, .. } = &daemon.configuration().source;
    let config = config.iter().map(|name| format!("--config={name}"));
    let sets = sets.iter().map(|set| format!("--set={set}"));
    let command = command.iter().map(|word| (*word).to_string());
    let words: Vec<String> = command
        .chain(["--json".to_string()])
        .chain(config)
        .chain(sets)
        .collect();
    object(daemon, purpose, &words).await
}

/// Runs a command that prints one JSON object.
async fn object(
    daemon: &Daemon,
    purpose: Purpose,
    words: &[String],
) -> Result<serde_json::Value, ComputeError> {
    let output = printed(daemon, purpose, process(daemon, words)?).await?;
    serde_json::from_slice(&output.stdout).map_err(|_| ComputeError::of(&output))
}

/// The page of recordings as HTML.
///
/// # Errors
/// When the process cannot be started, takes too long, or draws nothing.
pub async fn page(
    daemon: &Daemon,
    purpose: Purpose,
    files: &[String],
) -> Result<String, ComputeError> {
    let mut process = process(daemon, &["report".to_string()])?;
    process.args(["--out", "-", "--"]).args(files);
    let output = printed(daemon, purpose, process).await?;
    if output.status.success() {
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
    } else {
        Err(ComputeError::of(&output))
    }
}

/// Runs a process to its end when it has its turn, and ends it if it takes too long.
async fn printed(
    daemon: &Daemon,
    purpose: Purpose,
    mut process: Process,
) -> Result<Output, ComputeError> {
    let turn = daemon.computations.turn(purpose).await?;
    // A start that does not return, because the folder of the process does not answer, keeps its turn.
    let started = tokio::task::spawn_blocking(move || (process.spawn(), turn));
    let ended = async {
        let (child, turn) = started.await.map_err(io::Error::other)?;
        Ok::<_, io::Error>((child?.wait_with_output().await?, turn))
    };
    let ended = tokio::time::timeout(COMPUTATION, ended).await;
    let (output, _) = ended.map_err(|_| ComputeError::TooLong)??;
    Ok(output)
}

impl ComputeError {
    fn of(output: &Output) -> ComputeError {
        let errors = String::from_utf8_lossy(&output.stderr);
        ComputeError::NoResult(errors.lines().last().unwrap_or("no output").into())
    }
}
