//! The `bench` program: log to standard error, run the command, exit with its code.

use std::process::ExitCode;

use bench::cli;
use tracing_subscriber::EnvFilter;

fn main() -> ExitCode {
    let level = EnvFilter::try_from_env("BENCH_LOG").unwrap_or_else(|_| "warn".into());
    tracing_subscriber::fmt()
        .with_env_filter(level)
        .with_writer(std::io::stderr)
        // Otherwise a full standard error ends the program in a panic.
        .log_internal_errors(false)
        .init();
    cli::main().into()
}
