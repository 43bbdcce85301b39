//! `bench recover`: what can be trusted of a cut or damaged recording, as a complete one.

use std::path::PathBuf;

use super::error::CliError;
use super::outcome::Outcome;
use super::output::{print_json, print_text};
use crate::recording::recover;

/// Which recording.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// The recording (MCAP); it is not changed
    recording: PathBuf,
    /// The file to make [default: the recording's name with `_recovered`]
    #[arg(long, value_name = "FILE")]
    to: Option<PathBuf>,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    json: bool,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let stem = args
        .recording
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy();
    let to = args.to.clone().unwrap_or_else(|| {
        args.recording
            .with_file_name(format!("{stem}_recovered.mcap"))
    });
    let recovered = recover(&args.recording, &to)?;
    let (totals, lost) = (&recovered.totals, recovered.cut.as_ref());
    if args.json {
        print_json(&serde_json::json!({
            "recording": to.display().to_string(),
            "ticks": totals.ticks,
            "last_tick": totals.last_tick,
            "overruns": totals.overruns,
            "lost_records": totals.lost_records,
            "cut": lost.map(|cut| serde_json::json!({ "at_byte": cut.at_byte, "of_bytes": cut.of_bytes, "why": cut.why })),
        }))?;
    } else {
        let cut = lost.map_or("nothing is missing".into(), |cut| {
            format!(
                "bytes {} to {} could not be used: {}",
                cut.at_byte, cut.of_bytes, cut.why
            )
        });
        print_text(&format!(
            "{} ticks recovered into {}; {cut}\n",
            totals.ticks,
            to.display()
        ))?;
    }
    Ok(if totals.lost_records > 0 {
        Outcome::Impaired
    } else {
        Outcome::Done
    })
}
