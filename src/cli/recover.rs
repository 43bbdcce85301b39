//! `bench recover`: makes complete recordings from the intact parts of a truncated or damaged file.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::error::CliError;
use super::exit::Exit;
use super::output::print_result;
use bench_recording::{Cut, DamagedRange, MissingTicks, Recovered, Recovery, recover};

/// Which recording.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// The recording (MCAP); it is not changed
    recording: PathBuf,
    /// Output file [default: the name of the recording with `_recovered`]; the other recordings in the file get numbers
    #[arg(long, value_name = "FILE")]
    to: Option<PathBuf>,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    json: bool,
}

/// The JSON object of the command: that of the first recording, with the others.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    first: RecordingReport,
    other_recordings: Vec<RecordingReport>,
    unused: Vec<DamagedRange>,
}

/// A recovered recording.
#[derive(Debug, Serialize)]
struct RecordingReport {
    recording: String,
    from_byte: u64,
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

impl RecordingReport {
    fn of(recovered: &Recovered) -> RecordingReport {
        let totals = &recovered.totals;
        RecordingReport {
            recording: totals.path.display().to_string(),
            from_byte: recovered.from_byte,
            ticks: totals.ticks,
            last_tick: totals.last_tick,
            overruns: totals.overruns,
            lost_records: totals.lost_records,
            cut: recovered.cut.clone(),
            damage: recovered.damage.clone(),
            missing_ticks: recovered.missing_ticks.clone(),
            missing_attachments: recovered.missing_attachments.clone(),
            unchecked_messages: recovered.unchecked_messages,
        }
    }
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let to = args
        .to
        .clone()
        .unwrap_or_else(|| default_name(&args.recording));
    let recovery = recover(&args.recording, &to)?;
    let report = Report {
        first: RecordingReport::of(&recovery.first),
        other_recordings: recovery.others.iter().map(RecordingReport::of).collect(),
        unused: recovery.unused.clone(),
    };
    print_result(args.json, &report, |_| text(&recovery))?;
    Ok(if recovery.is_complete() {
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

/// The recordings, then the parts of the file that were not used.
fn text(recovery: &Recovery) -> String {
    let mut lines = Vec::new();
    lines.extend(places(recovery));
    lines.extend(recovery.recordings().flat_map(recording_lines));
    lines.extend(recovery.unused.iter().map(|unused| {
        let (from, to, why) = (unused.from_byte, unused.to_byte, &unused.why);
        format!("bytes {from} to {to} of the file were not used: {why}")
    }));
    if recovery.is_complete() {
        lines.push("nothing is missing".into());
    }
    lines.join("\n") + "\n"
}

/// Where the recordings begin, unless the file begins with the only one.
fn places(recovery: &Recovery) -> Option<String> {
    let begins: Vec<String> = recovery
        .recordings()
        .map(|recovered| recovered.from_byte.to_string())
        .collect();
    match begins.as_slice() {
        [_] if recovery.first.from_byte == 0 => None,
        [only] => Some(format!("the recording begins at byte {only} of the file")),
        all => Some(format!(
            "{} recordings found in the file, beginning at bytes {}",
            all.len(),
            all.join(", ")
        )),
    }
}

/// One line for the new recording, and one for each loss.
fn recording_lines(recovered: &Recovered) -> Vec<String> {
    let totals = &recovered.totals;
    let (ticks, path) = (totals.ticks, totals.path.display());
    let mut lines = vec![format!("{ticks} ticks recovered into {path}")];
    lines.extend(recovered.damage.iter().map(DamagedRange::to_string));
    lines.extend(recovered.missing_ticks.iter().map(MissingTicks::to_string));
    let cut = recovered.cut.as_ref();
    lines.extend(cut.map(|cut| cut_text(cut, totals.last_tick)));
    let attachments = recovered.missing_attachments.iter();
    lines.extend(attachments.map(|name| format!("the attachment {name} is missing")));
    lines.extend(other_losses(recovered));
    lines
}

fn cut_text(cut: &Cut, last_tick: Option<u64>) -> String {
    let (at_byte, of_bytes, why) = (cut.at_byte, cut.of_bytes, &cut.why);
    let last = last_tick.unwrap_or_default();
    format!(
        "bytes {at_byte} to {of_bytes} could not be used: {why}; whatever was recorded after tick {last} is missing"
    )
}

/// Losses without a place in the file.
fn other_losses(recovered: &Recovered) -> Vec<String> {
    let mut lines = Vec::new();
    let lost = recovered.totals.lost_records;
    let before = lost.saturating_sub(recovered.missing_tick_count());
    if before > 0 {
        lines.push(format!("{before} other records (ticks or events) are lost"));
    }
    if recovered.unchecked_messages > 0 {
        let count = recovered.unchecked_messages;
        lines.push(format!(
            "{count} messages have no CRC: whether they are altered is not known"
        ));
    }
    if !recovered.had_summary && recovered.cut.is_none() {
        lines.push("the summary at the end of the old file is missing or damaged; the new file has a new one".into());
    }
    lines
}
