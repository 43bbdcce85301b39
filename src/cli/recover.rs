//! `bench recover`: makes a complete recording from the intact parts of a truncated or damaged one.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::error::CliError;
use super::exit::Exit;
use super::output::print_result;
use bench_recording::{Cut, DamagedRange, MissingTicks, Recovered, recover};

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
    damage: Vec<DamagedRange>,
    missing_ticks: Vec<MissingTicks>,
    missing_attachments: Vec<String>,
    unchecked_messages: u64,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
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
        cut: recovered.cut.clone(),
        damage: recovered.damage.clone(),
        missing_ticks: recovered.missing_ticks.clone(),
        missing_attachments: recovered.missing_attachments.clone(),
        unchecked_messages: recovered.unchecked_messages,
    };
    print_result(args.json, &report, |report| text(report, &recovered))?;
    Ok(if recovered.is_complete() {
        Exit::Done
    } else {
        Exit::Impaired
    })
}

/// The recording's name with `_recovered`.
fn default_name(recording: &Path) -> PathBuf {
    let stem = recording.file_stem().unwrap_or_default();
    let name = format!("{}_recovered.mcap", stem.to_string_lossy());
    recording.with_file_name(name)
}

/// One line for the new recording, and one for each loss.
fn text(report: &Report, recovered: &Recovered) -> String {
    let mut lines = vec![format!(
        "{} ticks recovered into {}",
        report.ticks, report.recording
    )];
    lines.extend(report.damage.iter().map(DamagedRange::to_string));
    lines.extend(report.missing_ticks.iter().map(MissingTicks::to_string));
    lines.extend(
        report
            .cut
            .as_ref()
            .map(|cut| cut_text(cut, report.last_tick)),
    );
    let attachments = report.missing_attachments.iter();
    lines.extend(attachments.map(|name| format!("the attachment {name} is missing")));
    lines.extend(other_losses(report, recovered));
    if recovered.is_complete() {
        lines.push("nothing is missing".into());
    }
    lines.join("\n") + "\n"
}

fn cut_text(cut: &Cut, last_tick: Option<u64>) -> String {
    let (at_byte, of_bytes, why) = (cut.at_byte, cut.of_bytes, &cut.why);
    let last = last_tick.unwrap_or_default();
    format!(
        "bytes {at_byte} to {of_bytes} could not be used: {why}; whatever was recorded after tick {last} is missing"
    )
}

/// Losses without a place in the file.
fn other_losses(report: &Report, recovered: &Recovered) -> Vec<String> {
    let mut lines = Vec::new();
    let before = report
        .lost_records
        .saturating_sub(recovered.missing_tick_count());
    if before > 0 {
        lines.push(format!("{before} other records (ticks or events) are lost"));
    }
    if report.unchecked_messages > 0 {
        let count = report.unchecked_messages;
        lines.push(format!(
            "{count} messages have no CRC: whether they are altered is not known"
        ));
    }
    if !recovered.had_summary && report.cut.is_none() {
        lines.push("the summary at the end of the old file is missing or damaged; the new file has a new one".into());
    }
    lines
}
