//! `bench replay`: the recorded probe through the same loop.

use std::path::PathBuf;

use super::error::CliError;
use super::outcome::Outcome;
use super::output::{print_json, print_text};
use crate::experiment::{Replayed, replay};
use crate::recording::Recording;

/// Which recording.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// The recording (MCAP)
    recording: PathBuf,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let recording = Recording::open(&args.recording)?;
    let replayed = replay(&recording)
        .map_err(|e| CliError::Failed(format!("{}: {e}", args.recording.display())))?;
    let same = replayed.different == 0;
    if args.json {
        print_json(&serde_json::json!({
            "recording": args.recording.display().to_string(),
            "truncated": recording.truncated(),
            "ticks": replayed.ticks,
            "different": replayed.different,
            "identical": same,
            "first": replayed.first.map(|d| serde_json::json!({ "tick": d.tick, "recorded_a": d.recorded_a, "replayed_a": d.replayed_a })),
        }))?;
    } else {
        print_text(&text(&recording, &replayed))?;
    }
    Ok(if same { Outcome::Done } else { Outcome::Failed })
}

fn text(recording: &Recording, replayed: &Replayed) -> String {
    let cut = recording.cut().map_or(String::new(), |cut| {
        format!("the recording is cut off: {}\n", cut.why)
    });
    match replayed.first {
        None => format!(
            "{cut}{} ticks replayed, every command the same bit for bit\n",
            replayed.ticks
        ),
        Some(first) => format!(
            "{cut}{} of {} ticks DIFFER, the first at tick {}: recorded {:e} A, replayed {:e} A\n",
            replayed.different, replayed.ticks, first.tick, first.recorded_a, first.replayed_a
        ),
    }
}
