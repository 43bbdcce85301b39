//! `bench identify`: the analysis of `bench chirp`, from a recording.

use std::path::PathBuf;

use serde::Serialize;

use super::analysis_output::{Made, make};
use super::identify_table::{self, TableOptions};
use super::options::{print_json, print_text};
use super::{CliError, Outcome};
use crate::recording::Recording;
use crate::session::{Kind, Plan};

/// Which recording.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// The recording (MCAP) of a chirp, or a CSV of other hands with --input and --output
    recording: PathBuf,
    #[command(flatten)]
    table: TableOptions,
    /// One JSON object on standard output, nothing else there
    #[arg(long)]
    json: bool,
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    recording: String,
    ticks: u64,
    overruns: u64,
    lost_records: u64,
    truncated: bool,
    #[serde(flatten)]
    made: Made,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    if args.table.is_meant(&args.recording) {
        return identify_table::run(&args.recording, &args.table, args.json);
    }
    let recording = Recording::open(&args.recording)?;
    let plan = Plan::of(&recording)?;
    if plan.kind == Kind::Calibrate {
        let what = "is the recording of static steps, which `bench calibrate` analyses";
        return Err(CliError::Usage(format!("{} {what}", args.recording.display())));
    }
    if plan.kind == Kind::Quiet {
        let what = "is a quiet run of `bench campaign`, in which no current flowed: it says where the stage rests";
        return Err(CliError::Usage(format!("{} {what}", args.recording.display())));
    }
    let report = Report {
        recording: args.recording.display().to_string(),
        ticks: recording.tick_count(),
        overruns: recording.overruns(),
        lost_records: recording.lost_records(),
        truncated: recording.truncated(),
        made: make(&recording, &plan.config)?,
    };
    if args.json {
        print_json(&report)?
    } else {
        print_text(&report.made.text())?
    }
    let whole = report.overruns + report.lost_records == 0 && !report.truncated;
    Ok(if whole { Outcome::Done } else { Outcome::Impaired })
}
