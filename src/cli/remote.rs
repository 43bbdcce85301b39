//! `--connect http://HOST:PORT`: the command is carried out by the daemon of another machine, and prints here what it prints there.

use bytes::{Buf, Bytes};
use http_body_util::BodyExt;
use hyper::Method;
use hyper::body::Incoming;
use serde_json::{Value, json};
use tokio::time::{Duration, interval};

use super::description_options::DescriptionOptions;
use super::error::CliError;
use super::outcome::Outcome;
use super::output::{print_message, print_text};
use crate::daemon::OutputPiece;
use crate::daemon::http_client::{Ask, HttpError, Target, json as answer, send};
use crate::experiment::StopSignals;

/// Period of the renewals of the arm lease.
const RENEWAL: Duration = Duration::from_secs(3);

/// The daemon that `--connect` names, if it is at an address.
pub(super) fn target(arguments: &[String]) -> Option<Target> {
    let (_, value) = split(arguments, "--connect");
    value
        .filter(|value| value.starts_with("http://"))
        .map(|value| Target::of(&value))
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
    let sent_apart = ["--connect", "--name", "--note", "--operator"];
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
    let runtime = tokio::runtime::Builder::new_current_thread()
        .enable_all()
        .build();
    let runtime = runtime.map_err(|error| unreachable(target, &error.to_string()))?;
    runtime.block_on(carried_out(target, &arguments, description))
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
        Ok(run) => follow(target, &lease, run["id"].as_u64().unwrap_or_default()).await,
        Err(error) => Err(error),
    };
    // Without a release the lease expires by itself.
    let _ = ask(target, Method::DELETE, "/api/v1/lease", Some(&lease), None).await;
    outcome
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
async fn ask(
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
        Target::Tcp { address, .. } => address.clone(),
        Target::Socket(path) => path.display().to_string(),
    };
    CliError::Failed(format!(
        "--connect http://{address}: the daemon does not answer ({why}); check the address, and that `bench serve --listen` runs there"
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
        assert_eq!(target(&words("chirp --connect none")), None);
        let line = "chirp --name a --connect=http://lab:1 --note=b --operator c --seed 4";
        assert_eq!(command_line(&words(line)), words("chirp --seed 4"));
        assert_eq!(target(&words("chirp")), None);
    }
}
