//! `--connect http://HOST:PORT`: the command is carried out by the daemon of another machine, and prints here what it prints there.

use bytes::{Buf, Bytes};
use http_body_util::BodyExt;
use hyper::Method;
use hyper::body::Incoming;
use serde::Deserialize;
use serde_json::{Value, json};
use tokio::time::{Duration, interval};

use super::connection::SCHEME;
use super::description_options::DescriptionOptions;
use super::error::CliError;
use super::outcome::Outcome;
use super::output::{print_message, print_note, print_text};
use bench_daemon::http_client::{Ask, HttpError, Target, json as answer, send};
use bench_daemon::{Hold, OutputPiece};
use bench_experiment::StopSignals;

/// Period of the renewals of the arm lease.
const RENEWAL: Duration = Duration::from_secs(3);

/// Variable of the environment with the token.
const TOKEN_VARIABLE: &str = "BENCH_TOKEN";

/// The daemon that `--connect` names, if it is at an address.
pub(super) fn target(arguments: &[String]) -> Result<Option<Target>, CliError> {
    let (_, value) = split(arguments, "--connect");
    let Some(address) = value.as_deref().and_then(|url| url.strip_prefix(SCHEME)) else {
        return Ok(None);
    };
    let (_, file) = split(arguments, "--token-file");
    Ok(Some(tcp_target(address, file.as_deref())?))
}

/// The daemon at `HOST:PORT`, with the token of a file or of the environment.
pub(super) fn tcp_target(address: &str, token_file: Option<&str>) -> Result<Target, CliError> {
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
fn token(file: Option<&str>) -> Result<Option<String>, CliError> {
    let Some(file) = file else {
        return Ok(std::env::var(TOKEN_VARIABLE).ok());
    };
    let text = std::fs::read_to_string(file).map_err(|error| {
        CliError::Usage(format!(
            "--token-file {file}: {error}; give a file with the token of the daemon, which `bench serve --listen` names when it starts"
        ))
    })?;
    Ok(Some(text.trim().into()))
}

/// The arguments without an option such as `--connect`, and its value.
fn split(arguments: &[String], option: &str) -> (Vec<String>, Option<String>) {
    let mut rest = Vec::new();
    let mut value = None;
    let mut all = arguments.iter();
    while let Some(argument) = all.next() {
        match argument.strip_prefix(option) {
            Some("") => value = all.next().cloned(),
            Some(given) if given.starts_with('=') => value = Some(given[1..].to_string()),
            _ => rest.push(argument.clone()),
        }
    }
    (rest, value)
}

/// The arguments without the options that the request of the daemon or its arm lease contains.
fn command_line(arguments: &[String]) -> Vec<String> {
    let sent_apart = [
        "--connect",
        "--token-file",
        "--name",
        "--note",
        "--operator",
    ];
    sent_apart
        .iter()
        .fold(arguments.to_vec(), |rest, option| split(&rest, option).0)
}

/// Carries out the command line of this process at a daemon.
pub(super) fn carry_out(
    target: &Target,
    arguments: &[String],
    description: &DescriptionOptions,
) -> Result<Outcome, CliError> {
    let arguments = command_line(arguments);
    in_runtime(target, carried_out(target, &arguments, description))
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
    arguments: &[String],
    description: &DescriptionOptions,
) -> Result<Outcome, CliError> {
    let (command, args) = arguments
        .split_first()
        .map_or(("", &[][..]), |(first, rest)| (first.as_str(), rest));
    let lease = ask(
        target,
        Method::POST,
        "/api/v1/lease",
        None,
        Some(json!({ "operator": description.operator() })),
    )
    .await?;
    let lease = lease["lease"].as_str().unwrap_or_default().to_string();
    let request = json!({
        "command": command,
        "args": args,
        "name": description.name(),
        "note": description.note(),
    });
    let run = ask(
        target,
        Method::POST,
        "/api/v1/runs",
        Some(&lease),
        Some(request),
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
async fn follow(target: &Target, lease: &str, run: u64) -> Result<Outcome, CliError> {
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
                OutputPiece::Exit(code) => return Ok(outcome(code)),
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

fn outcome(code: i32) -> Outcome {
    match code {
        0 => Outcome::Done,
        2 => Outcome::Usage,
        3 => Outcome::Impaired,
        _ => Outcome::Failed,
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
    fn takes_the_option_out_of_the_arguments() {
        let words = |text: &str| -> Vec<String> { text.split(' ').map(String::from).collect() };
        for line in [
            "chirp --connect http://lab:1 --seed 4",
            "chirp --connect=http://lab:1 --seed 4",
        ] {
            let (rest, value) = split(&words(line), "--connect");
            assert_eq!(rest, words("chirp --seed 4"));
            assert_eq!(value.as_deref(), Some("http://lab:1"));
        }
        let line =
            "chirp --name a --connect=http://lab:1 --token-file t --note=b --operator c --seed 4";
        assert_eq!(command_line(&words(line)), words("chirp --seed 4"));
    }

    fn target_of(line: &str) -> Result<Option<Target>, CliError> {
        let words: Vec<String> = line.split(' ').map(String::from).collect();
        target(&words)
    }

    #[test]
    fn only_an_address_is_another_machine() {
        for line in ["chirp --connect none", "chirp --connect a.sock", "chirp"] {
            assert!(matches!(target_of(line), Ok(None)), "{line}");
        }
        let found = target_of("chirp --connect http://lab:8020").expect("an address");
        assert!(matches!(found, Some(Target::Tcp { address, .. }) if address == "lab:8020"));
    }

    #[test]
    fn token_comes_from_a_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("token");
        std::fs::write(&file, "0123\n").expect("a file");
        let line = format!("chirp --connect http://lab --token-file {}", file.display());
        let found = target_of(&line).expect("an address");
        assert_eq!(found, Some(Target::tcp("lab", Some("0123".into()))));
        let missing = target_of("chirp --connect http://lab --token-file /nonexistent/token");
        let error = missing.expect_err("no file").to_string();
        assert!(error.contains("--token-file /nonexistent/token"), "{error}");
    }

    #[test]
    fn rejects_token_among_the_arguments_without_repeating_it() {
        for address in [
            "http://lab:8020/#token=0123abcd",
            "http://lab:8020/?token=0123abcd",
            "http://x:0123abcd@lab:8020",
        ] {
            for line in [
                format!("chirp --connect {address}"),
                format!("chirp --connect={address}"),
            ] {
                let error = target_of(&line).expect_err("refused").to_string();
                assert!(!error.contains("0123abcd"), "{error}");
                assert!(
                    error.contains("--token-file") && error.contains("BENCH_TOKEN"),
                    "{error}"
                );
            }
        }
    }
}
