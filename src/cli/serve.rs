//! `bench serve`: the daemon.

use std::io::IsTerminal;
use std::net::SocketAddr;
use std::path::PathBuf;

use super::error::CliError;
use super::exit::Exit;
use super::output::print_text;
use super::table::labelled;
use bench_config::{Purpose, Source};
use bench_daemon::{DaemonConfig, ServeOptions, Started, own_socket, serve};
use bench_order::BenchOptions;
use bench_rig::devices::is_simulated;

/// Address of the page of a demonstration.
const DEMO_ADDRESS: SocketAddr =
    SocketAddr::new(std::net::IpAddr::V4(std::net::Ipv4Addr::LOCALHOST), 8020);

/// The bench of the daemon, and where it listens.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// A TOML file, or a profile by name
    #[arg(long, value_name = "FILE|NAME")]
    config: Option<String>,
    /// Override one setting (repeatable): --set loop.rate_hz=5000
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Socket for clients on this machine [default: $BENCH_SOCKET, or bench.sock in $XDG_RUNTIME_DIR or in a
    /// folder of the user for temporary files]
    #[arg(long, value_name = "PATH")]
    socket: Option<PathBuf>,
    /// Also listen on TCP, for the live page: 127.0.0.1:8020, or 0.0.0.0:8020 for other machines. Whatever changes
    /// something needs the token, which is in a file beside the socket
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<SocketAddr>,
    /// Also serve the channels of the recordings to Foxglove and Lichtblick: 127.0.0.1:8765. Everyone who reaches the
    /// address may read; nobody can change anything there
    #[arg(long, value_name = "ADDRESS:PORT")]
    foxglove: Option<SocketAddr>,
    /// Folder for the recordings
    #[arg(long, value_name = "DIR", default_value = "recordings")]
    out: PathBuf,
    /// Show the live page with a closed loop on the simulated stage (listens on 127.0.0.1:8020 without --listen)
    #[arg(long)]
    demo: bool,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let configuration = configuration(args)?;
    if args.demo && !is_simulated(&configuration.config) {
        return Err(CliError::Usage(
            "--demo starts a closed loop without an operator, so it is valid only for the simulated stage; leave it out".into(),
        ));
    }
    let options = ServeOptions {
        configuration,
        socket: args.socket.clone().unwrap_or_else(own_socket),
        listen: args.listen.or(args.demo.then_some(DEMO_ADDRESS)),
        foxglove: args.foxglove,
        recordings: args.out.clone(),
        demo: args.demo,
    };
    let served = serve(options, |started| {
        // A closed standard output does not end the daemon.
        let _ = print_text(&started_text(started));
    });
    match served {
        Ok(()) => Ok(Exit::Done),
        Err(error) => Err(CliError::Failed(error.to_string())),
    }
}

fn configuration(args: &Args) -> Result<DaemonConfig, CliError> {
    let bench = BenchOptions {
        config: args.config.clone(),
        sets: args.sets.clone(),
        ..BenchOptions::default()
    };
    let config = bench.load(Purpose::Chirp, &[])?;
    let named = args.config.clone().map(absolute_if_file);
    Ok(DaemonConfig {
        source: Source {
            config: named,
            sets: args.sets.clone(),
            ..Source::default()
        },
        config,
    })
}

/// Commands are started in another folder: a file is named by its absolute path.
fn absolute_if_file(name: String) -> String {
    match std::path::Path::new(&name).canonicalize() {
        Ok(path) if path.is_file() => path.display().to_string(),
        Ok(_) | Err(_) => name,
    }
}

/// What is printed at the start. The token is shown on a terminal only: a pipe or the journal may be read by others.
fn started_text(started: &Started) -> String {
    let page = if std::io::stdout().is_terminal() {
        started.page_with_token()
    } else {
        started.page.clone()
    };
    let page = page.map(|page| labelled("page", &page));
    let foxglove = started.foxglove.map(|address| format!("ws://{address}"));
    let foxglove = foxglove.map(|address| labelled("foxglove", &address));
    let file = started.token_file.as_ref();
    let file = file.map(|file| labelled("token", &format!("in {}", file.display())));
    format!(
        "the daemon runs; Ctrl-C ends it\n{}{}{}{}",
        labelled("socket", &started.socket.display().to_string()),
        page.unwrap_or_default(),
        foxglove.unwrap_or_default(),
        file.unwrap_or_default(),
    )
}
