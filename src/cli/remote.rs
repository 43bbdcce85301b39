//! `--connect http://HOST:PORT`: the command is carried out by the daemon of another machine, and prints here what it prints there.

use std::path::Path;

use bytes::{Buf, Bytes};
use http_body_util::BodyExt;
use hyper::Method;
use hyper::body::Incoming;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::time::{Duration, interval};

use super::description_options::DescriptionOptions;
use super::error::CliError;
use super::exit::Exit;
use super::output::{print_message, print_note, print_text};
use bench_daemon::http_client::{Ask, HttpError, Target, json as answer, send};
use bench_daemon::{Hold, OutputPiece};
use bench_experiment::StopSignals;
use bench_order::Order;

/// Period of the renewals of the arm lease.
const RENEWAL: Duration = Duration::from_secs(3);

/// Variable of the environment with the token.
const TOKEN_VARIABLE: &str = "BENCH_TOKEN";

/// The daemon at `HOST:PORT`, with the token of a file or of the environment.
pub(super) fn tcp_target(address: &str, token_file: Option<&Path>) -> Result<Target, CliError> {
    require_plain_address(address)?;
    Ok(Target::tcp(address, token(token_file)?))
}

/// Other users of the machine see the arguments of a process, so that the address must not contain the token.
fn require_plain_address(address: &str) -> Result<(), CliError> {
    if !address.contains(['#', '?', '@']) {
        Ok(())
    } else {
        Err(CliError::Usage(format!(
            "--connect: every user of this machine can read the arguments of a process, so that the token does not belong there; give http://HOST:PORT only, and the token with --token-file FILE or in the environment variable {TOKEN_VARIABLE}"
        )))
    }
}

/// The token in the file, or that of the environment.
fn token(file: Option<&Path>) -> Result<Option<String>, CliError> {
    let Some(file) = file else {
        return Ok(std::env::var(TOKEN_VARIABLE).ok());
    };
    let text = std::fs::read_to_string(file).map_err(|error| {
        CliError::Usage(format!(
            "--token-file {}: {error}; give a file with the token of the daemon, which `bench serve --listen` names when it starts",
            file.display()
        ))
    })?;
    Ok(Some(text.trim().into()))
}

/// Carries out an order at a daemon.
pub(super) fn carry_out(
    target: &Target,
    order: &Order,
    description: &DescriptionOptions,
) -> Result<Exit, CliError> {
    in_runtime(target, carried_out(target, order, description))
}

/// Waits for requests to a daemon.
pub(super) fn in_runtime<T>(
    target: &Target,
    requests: impl Future<Output = Result<T, CliError>>,
) -> Result<T, CliError> {
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build();
    let runtime = runtime.map_err(|error| unreachable(target, &error.to_string()))?;
    runtime.block_on(requests)
}

async fn carried_out(
    target: &Target,
    order: &Order,
    description: &DescriptionOptions,
) -> Result<Exit, CliError> {
    let lease = ask(
        target,
        Method::POST,
        "/api/v1/lease",
        None,
        Some(json!({ "operator": description.operator() })),
    )
    .await?;
    let lease = lease["lease"].as_str().unwrap_or_default().to_string();
    let run = ask(
        target,
        Method::POST,
        "/api/v1/runs",
        Some(&lease),
        Some(json!(description.request(order))),
    )
    .await;
    let outcome = match run {
        Ok(run) if run["phase"] == "held" => {
            let state = ask(target, Method::GET, "/api/v1/state", None, None).await?;
            print_note(&held_text(&state["held"]));
            follow(target, &lease, run["id"].as_u64().unwrap_or_default()).await
        }
        Ok(run) => follow(target, &lease, run["id"].as_u64().unwrap_or_default()).await,
        Err(error) => Err(error),
    };
    // Without a release the lease expires by itself.
    let _ = ask(target, Method::DELETE, "/api/v1/lease", Some(&lease), None).await;
    outcome
}

/// What the operator of a command reads that was accepted while the bench is held. The command keeps the lease.
fn held_text(held: &Value) -> String {
    let hold = Hold::deserialize(held).map(|hold| format!(": {hold}"));
    format!(
        "the bench is held{}; this command waits with the arm lease. End it with Ctrl-C, remove the cause, resume with `bench resume --connect URL`, and start it again",
        hold.unwrap_or_default()
    )
}

/// Prints what the run prints, keeps the lease, and passes stop signals on, until the run has ended.
async fn follow(target: &Target, lease: &str, run: u64) -> Result<Exit, CliError> {
    let path = format!("/api/v1/runs/{run}/output");
    let output = send(target, &Ask::get(&path))
        .await
        .map_err(|error| unreachable(target, &error.to_string()))?;
    let mut lines = Lines {
        body: output.into_body(),
        rest: Vec::new(),
    };
    let signals = StopSignals::listen();
    let mut signals = signals.map_err(|error| unreachable(target, &error.to_string()))?;
    let mut renewals = interval(RENEWAL);
    let mut how = "settle";
    loop {
        tokio::select! {
            piece = lines.next() => match piece.map_err(|error| unreachable(target, &error.to_string()))? {
                OutputPiece::Stdout(text) => print_text(&text)?,
                OutputPiece::Stderr(text) => print_message(&text),
                OutputPiece::Exit(code) => return Ok(exit(code)),
            },
            _ = renewals.tick() => drop(ask(target, Method::PUT, "/api/v1/lease", Some(lease), None).await?),
            () = signals.received() => {
                let path = format!("/api/v1/runs/{run}/stop");
                ask(target, Method::POST, &path, Some(lease), Some(json!({ "how": how }))).await?;
                how = "cut";
            }
        }
    }
}

fn exit(code: i32) -> Exit {
    match code {
        0 => Exit::Done,
        2 => Exit::Usage,
        3 => Exit::Impaired,
        _ => Exit::Failed,
    }
}

/// The lines of an answer that is still being written.
struct Lines {
    body: Incoming,
    rest: Vec<u8>,
}

impl Lines {
    async fn next(&mut self) -> Result<OutputPiece, HttpError> {
        loop {
            if let Some(end) = self.rest.iter().position(|byte| *byte == b'\n') {
                let line: Vec<u8> = self.rest.drain(..=end).collect();
                return Ok(serde_json::from_slice(&line)?);
            }
            match self.body.frame().await {
                Some(frame) => self.add(frame?.into_data().unwrap_or_default()),
                None => return Err(std::io::Error::other("the daemon has ended").into()),
            }
        }
    }

    fn add(&mut self, bytes: Bytes) {
        self.rest.extend_from_slice(bytes.chunk());
    }
}

/// The JSON of an answer; an error object is the error of the command.
pub(super) async fn ask(
    target: &Target,
    method: Method,
    path: &str,
    lease: Option<&str>,
    body: Option<Value>,
) -> Result<Value, CliError> {
    let ask = Ask {
        method,
        path,
        lease,
        body,
    };
    let (status, json) = answer(target, &ask)
        .await
        .map_err(|error| unreachable(target, &error.to_string()))?;
    match (status, json["error"]["message"].as_str()) {
        (200..=299, _) => Ok(json),
        (_, Some(message)) => Err(CliError::Failed(message.to_string())),
        (status, None) => Err(unreachable(target, &format!("status {status}"))),
    }
}

fn unreachable(target: &Target, why: &str) -> CliError {
    let address = match target {
        Target::Tcp { address, .. } => format!("http://{address}"),
        Target::Socket(path) => path.display().to_string(),
    };
    CliError::Failed(format!(
        "--connect {address}: the daemon does not answer ({why}); check the address, and that `bench serve` runs there (over TCP with --listen)"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn token_comes_from_a_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("token");
        std::fs::write(&file, "0123\n").expect("a file");
        let found = tcp_target("lab", Some(&file)).expect("an address");
        assert_eq!(found, Target::tcp("lab", Some("0123".into())));
        let missing = tcp_target("lab", Some("/nonexistent/token".as_ref()));
        let error = missing.expect_err("no file").to_string();
        assert!(error.contains("--token-file /nonexistent/token"), "{error}");
    }

    #[test]
    fn rejects_token_among_the_arguments_without_repeating_it() {
        for address in [
            "lab:8020/#token=0123abcd",
            "lab:8020/?token=0123abcd",
            "x:0123abcd@lab:8020",
        ] {
            let error = tcp_target(address, None).expect_err("refused").to_string();
            assert!(!error.contains("0123abcd"), "{error}");
            assert!(
                error.contains("--token-file") && error.contains("BENCH_TOKEN"),
                "{error}"
            );
        }
    }
}
