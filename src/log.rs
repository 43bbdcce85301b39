//! The log of the program, on standard error.

use std::io::IsTerminal;

use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::prelude::*;

/// Log lines go to standard error, with colours on a terminal only. `BENCH_LOG` chooses the level: `info`, or `bench_rt=debug,warn`.
pub(crate) fn start() {
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
