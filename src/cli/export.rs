//! `bench export`: the signals or the frequency response of a recording, as a file of another program.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::error::CliError;
use super::exit::Exit;
use super::identify::warn_of_unchecked;
use super::output::{print_result, warn};
use bench_experiment::{Ending, Plan, open_with_signals, recorded_frf};
use bench_export::{ExportError, Format, Response, Target, write_response, write_signals};
use bench_recording::Recording;

/// What is exported, and where it goes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// The recording (MCAP)
    recording: PathBuf,
    /// Format of the file
    #[arg(long, value_enum)]
    format: Format,
    /// Export the frequency response of the recording, as `bench identify` estimates it, not the time signals
    #[arg(long)]
    frf: bool,
    /// The file, which must not exist [default: the recording with the ending of the format, with `_frf` for --frf, and with a
    /// number if that exists]
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    json: bool,
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    recording: String,
    outcome: Ending,
    ticks: u64,
    overruns: u64,
    lost_records: u64,
    truncated: bool,
    format: Format,
    file: String,
    /// Number of ticks or of frequencies.
    rows: u64,
}

impl From<ExportError> for CliError {
    fn from(error: ExportError) -> CliError {
        let text = error.to_string();
        match error {
            ExportError::Recording(error) => error.into(),
            error if error.is_failure() => CliError::Failed(text),
            _ => CliError::Usage(text),
        }
    }
}

/// An exported file, and what it was made from.
struct Exported {
    recording: Recording,
    file: PathBuf,
    rows: u64,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let target = target(args);
    target.check()?;
    args.format.check()?;
    let exported = if args.frf {
        export_response(args, &target)?
    } else {
        export_signals(args, &target)?
    };
    let recording = &exported.recording;
    let defects = defects(recording, args.frf);
    warn_of_unchecked(recording);
    warn(&defects);
    let report = Report::new(args, &exported);
    print_result(args.json, &report, |report| {
        format!("file       {}\n", report.file)
    })?;
    Ok(if defects.is_empty() {
        Exit::Done
    } else {
        Exit::Impaired
    })
}

/// The file that is named, or one beside the recording.
fn target(args: &Args) -> Target {
    let Some(out) = &args.out else {
        let stem = args.recording.file_stem().unwrap_or_default();
        let suffix = if args.frf { "_frf" } else { "" };
        let name = format!("{}{suffix}{}", stem.to_string_lossy(), args.format.ending());
        return Target::Numbered(args.recording.with_file_name(name));
    };
    Target::Named(out.clone())
}

fn export_signals(args: &Args, target: &Target) -> Result<Exported, CliError> {
    let (recording, file) = write_signals(&args.recording, args.format, target)?;
    Ok(Exported {
        rows: recording.tick_count(),
        recording,
        file,
    })
}

fn export_response(args: &Args, target: &Target) -> Result<Exported, CliError> {
    let (recording, signals) = open_with_signals(&args.recording)?;
    let plan = Plan::of(&recording)?;
    let frf = recorded_frf(&recording, signals, &plan)?;
    let response = Response {
        frf: &frf,
        period_s: plan.config.servo.period_s(),
        source: &name(&args.recording),
    };
    let file = write_response(&response, args.format, target)?;
    Ok(Exported {
        recording,
        file,
        rows: frf.len() as u64,
    })
}

fn name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// What the file lacks because the recording lacks it. A run that ended early has all its signals, but not all of its response.
fn defects(recording: &Recording, is_response: bool) -> Vec<String> {
    let ending = Ending::of(recording);
    let cut_off = recording.truncated() || ending == Ending::CutOff;
    let cut_off = cut_off.then(|| {
        let last = recording.last_tick();
        format!(
            "the recording is cut off, so the file lacks everything after tick {last}; `bench recover` shows where it ends"
        )
    });
    let ended_early = ending
        .caution()
        .filter(|_| is_response && cut_off.is_none());
    let (overruns, lost) = (recording.overruns(), recording.lost_records());
    let incomplete = (overruns + lost > 0).then(|| missing_text(overruns, lost, is_response));
    let defects = [cut_off, ended_early, incomplete];
    let path = recording.path().display();
    let defects = defects.into_iter().flatten();
    defects.map(|defect| format!("{path}: {defect}")).collect()
}

fn missing_text(overruns: u64, lost: u64, is_response: bool) -> String {
    let consequence = if is_response {
        "the positions of missing ticks are estimated in the response; repeat the run if that is not acceptable"
    } else {
        "the file lacks these ticks; the column `tick` shows where"
    };
    format!("{overruns} overruns and {lost} lost records: {consequence}")
}

impl Report {
    fn new(args: &Args, exported: &Exported) -> Report {
        let recording = &exported.recording;
        Report {
            recording: args.recording.display().to_string(),
            outcome: Ending::of(recording),
            ticks: recording.tick_count(),
            overruns: recording.overruns(),
            lost_records: recording.lost_records(),
            truncated: recording.truncated(),
            format: args.format,
            file: exported.file.display().to_string(),
            rows: exported.rows,
        }
    }
}
