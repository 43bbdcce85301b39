//! `--connect`: whether a run is made by a daemon of this machine, or in this process.

use std::path::PathBuf;
use std::sync::Arc;

use super::description_options::DescriptionOptions;
use super::error::CliError;
use super::remote::tcp_target;
use bench_daemon::client::{DaemonOwner, rig_of, running_daemon};
use bench_daemon::http_client::Target;
use bench_experiment::{RigOwner, Stage};
use bench_order::Order;

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
    /// The daemon at an address, which carries out the whole command; `None` for a daemon of this machine or this process.
    pub fn remote(&self) -> Result<Option<Target>, CliError> {
        let connect = self.connect.as_deref();
        match connect.and_then(|url| url.strip_prefix(SCHEME)) {
            Some(address) => Ok(Some(tcp_target(address, self.token_file.as_deref())?)),
            None => Ok(None),
        }
    }

    /// The daemon that makes the runs; `None` for this process.
    pub fn owner(
        &self,
        stage: Stage,
        order: &Order,
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
        let owner = socket.map(|socket| {
            DaemonOwner::new(socket, description.request(order), description.operator())
        });
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_an_address_is_another_machine() {
        let option = |connect: Option<&str>| ConnectOption {
            connect: connect.map(String::from),
            token_file: None,
        };
        for local in [Some("none"), Some("a.sock"), None] {
            assert!(matches!(option(local).remote(), Ok(None)), "{local:?}");
        }
        let found = option(Some("http://lab:8020")).remote();
        let found = found.expect("an address");
        assert!(matches!(found, Some(Target::Tcp { address, .. }) if address == "lab:8020"));
    }
}
