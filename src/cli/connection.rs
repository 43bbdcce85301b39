//! `--connect`: whether a run is made by a daemon of this machine, or in this process.

use std::path::PathBuf;
use std::sync::Arc;

use super::arguments::arguments;
use super::description_options::DescriptionOptions;
use super::error::CliError;
use bench_daemon::client::{DaemonOwner, rig_of, running_daemon};
use bench_daemon::{Command, OnDisconnect, RunRequest};
use bench_experiment::{RigOwner, Stage};

/// Where runs are made.
#[derive(Clone, Debug, Default, clap::Args)]
pub(super) struct ConnectOption {
    /// Run at the daemon of this socket, or `none`: in this process [default: at the daemon of this machine, if one runs
    /// on the same kind of bench]; http://HOST:PORT carries out the whole command there
    #[arg(long, value_name = "PATH|URL|none")]
    connect: Option<String>,
    /// File with the token of the daemon at --connect http://HOST:PORT [default: $BENCH_TOKEN]
    #[arg(long, value_name = "FILE", requires = "connect")]
    token_file: Option<PathBuf>,
}

impl ConnectOption {
    /// The daemon that makes the runs; `None` for this process.
    pub fn owner(
        &self,
        stage: Stage,
        description: &DescriptionOptions,
    ) -> Result<Option<Arc<dyn RigOwner>>, CliError> {
        let socket = match self.connect.as_deref() {
            Some("none") if self.token_file.is_none() => return Ok(None),
            // The whole command is carried out there, before it gets here.
            Some(url) if url.starts_with(SCHEME) => return Ok(None),
            _ if self.token_file.is_some() => return Err(token_without_url()),
            Some(path) => Some(required(PathBuf::from(path), stage)?),
            None => running_daemon().filter(|socket| rig_of(socket).ok() == Some(stage)),
        };
        let owner = socket
            .map(|socket| DaemonOwner::new(socket, request(description), description.operator()));
        Ok(owner.map(|owner| Arc::new(owner) as Arc<dyn RigOwner>))
    }
}

/// What the address of a daemon begins with.
pub(super) const SCHEME: &str = "http://";

fn token_without_url() -> CliError {
    CliError::Usage(
        "--token-file is for a daemon at --connect http://HOST:PORT; leave it out".into(),
    )
}

/// A daemon that the operator named must run, with the same kind of bench.
fn required(socket: PathBuf, stage: Stage) -> Result<PathBuf, CliError> {
    let shown = socket.display();
    match rig_of(&socket) {
        Err(error) => Err(CliError::Failed(format!(
            "--connect {shown}: no daemon answers ({error}); start it with `bench serve`, or leave --connect out"
        ))),
        Ok(rig) if rig != stage => Err(CliError::Usage(format!(
            "--connect {shown}: the daemon runs {}, and this command is for {}; choose the configuration of the daemon with --config, or add --connect none",
            name(rig),
            name(stage)
        ))),
        Ok(_) => Ok(socket),
    }
}

fn name(stage: Stage) -> &'static str {
    match stage {
        Stage::Simulated => "the simulated stage",
        Stage::Devices => "devices",
    }
}

/// The command line of this process, for the queue of the daemon.
fn request(description: &DescriptionOptions) -> RunRequest {
    let mut words = arguments();
    let named = words.next().unwrap_or_default();
    let command = Command::ALL
        .into_iter()
        .find(|command| command.name() == named);
    RunRequest {
        command: command.unwrap_or(Command::Chirp),
        args: words.collect(),
        name: description.name().into(),
        note: description.note().into(),
        on_disconnect: OnDisconnect::Default,
    }
}
