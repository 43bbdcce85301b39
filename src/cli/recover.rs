//! `bench recover`: makes a complete recording from the intact part of a truncated or damaged one.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::error::CliError;
use super::outcome::Outcome;
use super::output::print_result;
use crate::recording::{Cut, recover};

/// Which recording.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// The recording (MCAP); it is not changed
    recording: PathBuf,
    /// Output file [default: the name of the recording with `_recovered`]
    #[arg(long, value_name = "FILE")]
    to: Option<PathBuf>,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    json: bool,
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    recording: String,
    ticks: u64,
    last_tick: Option<u64>,
    overruns: u64,
    lost_records: u64,
    cut: Option<Cut>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let to = args
        .to
        .clone()
        .unwrap_or_else(|| default_name(&args.recording));
    let recovered = recover(&args.recording, &to)?;
    let totals = &recovered.totals;
    let report = Report {
        recording: to.display().to_string(),
        ticks: totals.ticks,
        last_tick: totals.last_tick,
        overruns: totals.overruns,
        lost_records: totals.lost_records,
        cut: recovered.cut,
    };
    print_result(args.json, &report, text)?;
    Ok(match report.lost_records {
        0 => Outcome::Done,
        _ => Outcome::Impaired,
    })
}

/// The recording's name with `_recovered`.
fn default_name(recording: &Path) -> PathBuf {
    let stem = recording.file_stem().unwrap_or_default();
    let name = format!("{}_recovered.mcap", stem.to_string_lossy());
    recording.with_file_name(name)
}

fn text(report: &Report) -> String {
    let cut = match &report.cut {
        None => "nothing is missing".into(),
        Some(cut) => format!(
            "bytes {} to {} could not be used: {}",
            cut.at_byte, cut.of_bytes, cut.why
        ),
    };
    let (ticks, recording) = (report.ticks, &report.recording);
    format!("{ticks} ticks recovered into {recording}; {cut}\n")
}
