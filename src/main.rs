//! The `bench` program: log to standard error, run the command, exit with its code.

use std::io::IsTerminal;
use std::process::ExitCode;

use bench::cli;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::prelude::*;

fn main() -> ExitCode {
    start_log();
    cli::main().into()
}

/// Log lines go to standard error, with colours on a terminal only. `BENCH_LOG` chooses the level: `info`, or `bench_rt=debug,warn`.
fn start_log() {
    let chosen = std::env::var("BENCH_LOG")
        .ok()
        .and_then(|text| text.parse::<Targets>().ok());
    let filter = chosen.unwrap_or_else(|| Targets::new().with_default(LevelFilter::WARN));
    // With internal errors logged, a full standard error would end the program in a panic.
    let lines = tracing_subscriber::fmt::layer()
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .log_internal_errors(false);
    tracing_subscriber::registry()
        .with(lines)
        .with(bench_daemon::WarningCopies)
        .with(filter)
        .init();
}
