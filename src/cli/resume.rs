//! `bench resume`: releases the bench of a daemon after a stop or a trip.

use std::path::PathBuf;

use hyper::Method;
use serde::Serialize;
use serde_json::{Value, json};
use tokio::time::{Duration, sleep};

use super::connection::SCHEME;
use super::description_options::user;
use super::error::CliError;
use super::exit::Exit;
use super::output::print_result;
use super::remote::{ask, in_runtime, tcp_target};
use super::table::wrap;
use bench_daemon::client::running_daemon;
use bench_daemon::http_client::Target;
use bench_experiment::operator_name;

/// Pause between two attempts to take the lease.
const RETRY: Duration = Duration::from_millis(250);
/// Attempts to take a lease that a stopped run keeps until its end: 10 s.
const ATTEMPTS: usize = 40;

/// Daemon and operator
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// The daemon: its socket, or http://HOST:PORT [default: the daemon of this machine]
    #[arg(long, value_name = "PATH|URL")]
    connect: Option<String>,
    /// File with the token of the daemon at --connect http://HOST:PORT [default: $BENCH_TOKEN]
    #[arg(long, value_name = "FILE", requires = "connect")]
    token_file: Option<PathBuf>,
    /// Who resumes [default: the user]
    #[arg(long, value_name = "NAME", value_parser = operator_name, allow_hyphen_values = true)]
    operator: Option<String>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

/// What was released.
#[derive(Debug, Serialize)]
struct Resumed {
    /// Why the bench was held, as in the state of the daemon; `null` if it was not held.
    held: Value,
    /// The trip that was acknowledged; `null` without one.
    trip: Value,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let target = daemon_target(args)?;
    let operator = args.operator.clone().or_else(user);
    let operator = operator.unwrap_or_else(|| "unknown".into());
    let resumed = in_runtime(&target, resume(&target, &operator))?;
    print_result(args.json, &resumed, text)?;
    Ok(Exit::Done)
}

/// The daemon that is named, or that of this machine.
fn daemon_target(args: &Args) -> Result<Target, CliError> {
    let Some(named) = args.connect.as_deref() else {
        return running_daemon().map(Target::Socket).ok_or_else(|| {
            CliError::Failed(
                "no daemon runs on this machine; start it with `bench serve`, or name its socket or address with --connect".into(),
            )
        });
    };
    if let Some(address) = named.strip_prefix(SCHEME) {
        return tcp_target(address, args.token_file.as_deref());
    }
    match named {
        "none" => Err(CliError::Usage(
            "--connect none: there is no daemon then; name its socket or its address, or leave --connect out".into(),
        )),
        path => Ok(Target::Socket(path.into())),
    }
}

async fn resume(target: &Target, operator: &str) -> Result<Resumed, CliError> {
    let lease = take_lease(target, operator).await?;
    let state = ask(target, Method::GET, "/api/v1/state", None, None).await;
    let resumed = ask(target, Method::POST, "/api/v1/resume", Some(&lease), None).await;
    // Without a release the lease expires by itself.
    let _ = ask(target, Method::DELETE, "/api/v1/lease", Some(&lease), None).await;
    resumed?;
    let state = state?;
    Ok(Resumed {
        held: state["held"].clone(),
        trip: state["trip"].clone(),
    })
}

/// Takes the lease. A run that was stopped keeps its lease until its end.
async fn take_lease(target: &Target, operator: &str) -> Result<String, CliError> {
    let mut attempts = 0;
    loop {
        let body = json!({ "operator": operator });
        let given = ask(target, Method::POST, "/api/v1/lease", None, Some(body)).await;
        attempts += 1;
        match given {
            Ok(given) => return Ok(given["lease"].as_str().unwrap_or_default().into()),
            Err(error) if attempts >= ATTEMPTS || !run_keeps_lease(target).await => {
                return Err(error);
            }
            Err(_) => sleep(RETRY).await,
        }
    }
}

/// Whether a run, and no operator, keeps the lease, or it was released meanwhile.
async fn run_keeps_lease(target: &Target) -> bool {
    let state = ask(target, Method::GET, "/api/v1/state", None, None).await;
    state.is_ok_and(|state| state["lease"]["expires_in_s"].is_null())
}

fn text(resumed: &Resumed) -> String {
    let by = resumed.held["by"].as_str();
    let trip = resumed.trip["text"].as_str();
    let what = match (by, trip) {
        (None, None) => "the bench was not held; commands start as usual".to_string(),
        (Some(by), None) => format!("the bench is released; it was held since a stop by {by}"),
        (_, Some(trip)) => format!("the bench is released, and the trip is acknowledged: {trip}"),
    };
    wrap(&what, 0)
}
