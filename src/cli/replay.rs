//! `bench replay`: runs the same loop on the recorded probe measurements.

use std::path::PathBuf;

use serde::Serialize;

use super::error::CliError;
use super::exit::Exit;
use super::identify::warn_of_unchecked;
use super::output::print_result;
use bench_experiment::{Difference, replay};
use bench_recording::{Cut, Recording};

/// Which recording.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// The recording (MCAP)
    recording: PathBuf,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    json: bool,
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    recording: String,
    truncated: bool,
    ticks: u64,
    different: u64,
    identical: bool,
    first: Option<Difference>,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let recording = Recording::open(&args.recording)?;
    warn_of_unchecked(&recording);
    let replayed = replay(&recording)
        .map_err(|e| CliError::Failed(format!("{}: {e}", args.recording.display())))?;
    let report = Report {
        recording: args.recording.display().to_string(),
        truncated: recording.truncated(),
        ticks: replayed.ticks,
        different: replayed.different,
        identical: replayed.different == 0,
        first: replayed.first,
    };
    print_result(args.json, &report, |report| text(report, recording.cut()))?;
    Ok(if report.identical {
        Exit::Done
    } else {
        Exit::Failed
    })
}

fn text(report: &Report, cut: Option<&Cut>) -> String {
    let cut = cut.map_or(String::new(), |cut| {
        format!("the recording is cut off: {}\n", cut.why)
    });
    let Report {
        ticks, different, ..
    } = report;
    match &report.first {
        None => format!("{cut}{ticks} ticks replayed, every command the same bit for bit\n"),
        Some(first) => format!(
            "{cut}{different} of {ticks} ticks DIFFER, the first at tick {}: recorded {:e} A, replayed {:e} A\n",
            first.tick, first.recorded_a, first.replayed_a
        ),
    }
}
