//! Commands as processes of their own: they send their plan to the owner of the rig and analyse the recording in their own memory.

use std::io;
use std::path::Path;
use std::pin::pin;
use std::process::{ExitStatus, Output, Stdio};
use std::sync::Arc;
use std::time::Duration;

use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;
use tokio::io::{AsyncRead, AsyncReadExt};
use tokio::process::{Child, Command as Process};

use super::catalogue::Catalogue;
use super::computations::{Busy, Purpose};
use super::output::{OutputPiece, RunOutput};
use super::run_entry::{Command, RunRequest};
use super::secret::Secret;
use super::shared::Daemon;
use super::socket::{SOCKET_VARIABLE, TICKET_VARIABLE};
use bench_config::{Source, texts_of_set};
use bench_experiment::option_in;

/// Longest time of a computation without motion.
const COMPUTATION: Duration = Duration::from_secs(60);
/// Longest time in which a stopped process ends by itself.
const END_TIME: Duration = Duration::from_secs(5);
/// Most arguments of a command.
const MAX_ARGS: usize = 200;
/// Longest arguments of a command together, in bytes.
const MAX_ARG_BYTES: usize = 16 << 10;
/// Exit code of a command that was stopped before its process began.
const STOPPED: i32 = 1;

/// Arguments that a client may not give.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ArgsError {
    /// The daemon chooses the value of this option.
    #[error("{0} cannot be given here, because the daemon chooses it; leave it out")]
    Reserved(String),
    /// A path outside the folder of the daemon.
    #[error(
        "`{0}` is a path outside the folder of the daemon; name a profile, or a file in that folder"
    )]
    Outside(String),
    /// Too many, or too long.
    #[error(
        "a command has at most {MAX_ARGS} arguments of together at most {MAX_ARG_BYTES} bytes, without a zero byte; shorten it"
    )]
    TooLong,
}

/// Options that the daemon gives itself.
const RESERVED: [&str; 3] = ["--connect", "--out", "--plan"];

/// Refuses arguments with which a command would read or write outside the folder of the daemon.
///
/// # Errors
/// With the first argument that is refused.
pub fn check_args(args: &[String]) -> Result<(), ArgsError> {
    let bytes: usize = args.iter().map(String::len).sum();
    let has_zero = args.iter().any(|arg| arg.contains('\0'));
    if args.len() > MAX_ARGS || bytes > MAX_ARG_BYTES || has_zero {
        return Err(ArgsError::TooLong);
    }
    for arg in args {
        let option = option_in(arg).unwrap_or_default();
        let option = option.split('=').next().unwrap_or_default();
        if RESERVED.contains(&option) {
            return Err(ArgsError::Reserved(option.into()));
        }
        if is_outside(arg) {
            return Err(ArgsError::Outside(arg.clone()));
        }
    }
    Ok(())
}

/// Refuses arguments that leave the folder through a link. It asks the file system.
///
/// # Errors
/// With the first argument that is refused.
pub fn check_links(args: &[String], catalogue: &Catalogue) -> Result<(), ArgsError> {
    let leaves = |arg: &&String| paths_in(arg).iter().any(|path| catalogue.leaves(path));
    match args.iter().find(leaves) {
        Some(arg) => Err(ArgsError::Outside(arg.clone())),
        None => Ok(()),
    }
}

/// Whether an argument may be a path that leaves the folder. Quantities such as `0.1mm/s` are not paths.
fn is_outside(arg: &str) -> bool {
    paths_in(arg).iter().any(|text| leaves_folder(text))
}

/// What may be a path in an argument.
fn paths_in(arg: &str) -> Vec<String> {
    let after_option = match arg.strip_prefix("--") {
        Some(option) => option.split_once('=').map_or("", |(_, value)| value),
        None => arg,
    };
    let last = arg.rsplit('=').next().unwrap_or(arg);
    let mut texts = vec![after_option.to_string(), last.to_string()];
    texts.extend(texts_of_set(after_option));
    texts.iter().map(|text| plain_path(text)).collect()
}

/// A text without the quotation marks of TOML.
fn plain_path(text: &str) -> String {
    text.trim().trim_matches(['"', '\'']).into()
}

fn leaves_folder(path: &str) -> bool {
    let mut parts = Path::new(path).components();
    path.starts_with(['/', '~']) || parts.any(|part| part.as_os_str() == "..")
}

/// Commands that take the configuration from the recording.
const WITHOUT_CONFIG: [&str; 2] = ["identify", "report"];

/// The program of the daemon itself, with a command (`chirp`, or `model modes`) and arguments. The configuration of the daemon
/// applies unless the client names another.
fn process(daemon: &Daemon, command: &[&str], args: &[String]) -> io::Result<Process> {
    let program = std::env::current_exe()?;
    let mut process = Process::new(program);
    process.args(command);
    if !command.iter().any(|word| WITHOUT_CONFIG.contains(word)) {
        process.args(source_args(&daemon.configuration().source, args));
    }
    process
        .args(args)
        .current_dir(&daemon.recordings)
        .env(SOCKET_VARIABLE, &daemon.socket)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .kill_on_drop(true);
    Ok(process)
}

/// The options of the configuration of the daemon.
fn source_args(source: &Source, args: &[String]) -> Vec<String> {
    let names_config = |arg: &String| arg == "--config" || arg.starts_with("--config=");
    if args.iter().any(names_config) {
        return Vec::new();
    }
    let config = source.config.iter();
    let config = config.flat_map(|name| ["--config".to_string(), name.clone()]);
    let sets = source.sets.iter();
    let sets = sets.flat_map(|set| ["--set".to_string(), set.clone()]);
    config.chain(sets).collect()
}

/// Runs a command to its end, or ends its process when `stopped` is ready; returns its exit code.
///
/// # Errors
/// When the system refuses the process.
pub async fn run(
    daemon: &Daemon,
    request: &RunRequest,
    ticket: &Secret,
    output: &Arc<RunOutput>,
    stopped: impl Future<Output = ()>,
) -> io::Result<i32> {
    let command = request.command;
    let mut process = process(daemon, &[command.name()], &request.args)?;
    process.env(TICKET_VARIABLE, ticket.reveal());
    if command != Command::Identify {
        process.arg("--out").arg(&daemon.recordings);
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

/// Runs a command that moves nothing and prints one JSON object.
///
/// # Errors
/// When the process cannot be started, takes too long, or prints no object.
pub async fn compute(
    daemon: &Daemon,
    purpose: Purpose,
    command: &[&str],
    args: &[String],
) -> Result<serde_json::Value, ComputeError> {
    // In front of the others, so that none of them takes it as its value.
    let args = [&["--json".to_string()], args].concat();
    let process = process(daemon, command, &args)?;
    let output = printed(daemon, purpose, process).await?;
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
    let mut process = process(daemon, &["report"], files)?;
    process.args(["--out", "-"]);
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

#[cfg(test)]
mod tests {
    use super::*;

    fn checked(args: &[&str]) -> Result<(), ArgsError> {
        let args: Vec<String> = args.iter().map(|arg| (*arg).to_string()).collect();
        check_args(&args)
    }

    #[test]
    fn refuses_paths_outside_the_folder_and_reserved_options() {
        for args in [
            &["--config", "/etc/passwd"][..],
            &["--config=/etc/passwd"],
            &["--set", "calibration.file=\"/etc/passwd\""],
            &["--set", "calibration.file= /etc/passwd"],
            &["--set", "calibration.file=\"/etc/passwd\" # =x"],
            &["--set", "calibration.file=\"\\u002fetc/passwd\""],
            &["--set=interlock.heat_file= ../x"],
            &["--set", "a={b=[\"x\", \"../c\"], d=1}"],
            &["--controller", "../secret.toml"],
            &["--reference", "a/../../b.csv"],
            &["--controller", "~/x.toml"],
            &["--out", "x"],
            &["--out=x"],
            &["--connect", "none"],
        ] {
            assert!(checked(args).is_err(), "{args:?}");
        }
    }

    #[test]
    fn refuses_arguments_that_are_too_many_or_too_long() {
        assert!(checked(&vec!["x"; MAX_ARGS]).is_ok());
        assert_eq!(checked(&vec!["x"; MAX_ARGS + 1]), Err(ArgsError::TooLong));
        let long = "x".repeat(MAX_ARG_BYTES / 2);
        let long = long.as_str();
        assert!(checked(&[long, long]).is_ok());
        assert_eq!(checked(&[long, long, "x"]), Err(ArgsError::TooLong));
        assert_eq!(checked(&["a\0b"]), Err(ArgsError::TooLong));
    }

    #[test]
    fn accepts_quantities_profiles_and_files_of_the_folder() {
        for args in [
            &["--amplitude", "0.2A", "--band", "1Hz..200Hz"][..],
            &["--speed", "0.1mm/s"],
            &["--operating-point", "-3.8mm"],
            &["--config", "stage", "--set", "loop.rate_hz=5000"],
            &["--controller", "own.toml"],
            &["--set=chirp.stop_hz=200"],
            &["--set", "sim.noise=[1e-9, 2e-9]"],
            &["--reference=step"],
        ] {
            assert_eq!(checked(args), Ok(()), "{args:?}");
        }
    }
}
