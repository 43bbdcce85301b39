//! `bench identify`: the analysis of `bench chirp`, from a recording.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::analysis_output::{self, analyse_and_write, in_folder};
use super::error::CliError;
use super::exit::Exit;
use super::figure_options::magnitude_axis;
use super::identify_external;
use super::identify_response;
use super::output::print_result;
use super::progress::ProgressLine;
use super::run_options::{description_text, trip_text};
use bench_base::progress::Progress;
use bench_config::Config;
use bench_experiment::outputs::{AnalysisOutputs, ExistingFile, ResultFiles};
use bench_experiment::{
    Description, Ending, Plan, ReadSignals, RunKind, TripSummary, open_with_signals,
};
use bench_order::{GLOSSARY, IdentifyOrder};
use bench_recording::Recording;

/// The order, and where the results go.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = GLOSSARY)]
pub(super) struct Args {
    #[command(flatten)]
    order: IdentifyOrder,
    /// Output folder [default: the folder of the input file]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    /// Name, note and operator.
    #[serde(flatten)]
    description: Description,
    /// `completed`, `tripped`, `stopped`, or `cut_off` if the file ends before the run.
    outcome: Ending,
    trip: Option<TripSummary>,
    recording: String,
    ticks: u64,
    overruns: u64,
    lost_records: u64,
    truncated: bool,
    #[serde(flatten)]
    made: AnalysisOutputs,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    if let Some(frf) = &args.order.response.frf {
        return identify_response::run(frf, args.out.as_deref(), &args.order);
    }
    // The parser requires one of the two.
    let path = args.order.file().unwrap_or(Path::new(""));
    if args.order.table.selects_csv(path) {
        return identify_external::run(
            path,
            args.out.as_deref(),
            &args.order.table,
            magnitude_axis(args.order.figures),
            args.order.json,
        );
    }
    let (recording, signals) = open_with_signals(path)?;
    warn_of_unchecked(&recording);
    let plan = Plan::of(&recording)?;
    check_kind(plan.kind, path)?;
    let made = analysed(&recording, signals, &plan.config, args)?;
    let report = Report::new(&recording, path, made);
    print_result(args.order.json, &report, |report| report.text(&plan.config))?;
    Ok(if report.is_whole() {
        Exit::Done
    } else {
        Exit::Impaired
    })
}

/// Warns of messages that no CRC covers.
pub(super) fn warn_of_unchecked(recording: &Recording) {
    let messages = recording.unchecked_messages();
    if messages > 0 {
        tracing::warn!(
            "{}: {messages} messages have no CRC, so that damaged values are not detected; use the recording as bench made it, if there is one",
            recording.path().display()
        );
    }
}

/// Refuses a recording without an excitation.
fn check_kind(kind: RunKind, path: &Path) -> Result<(), CliError> {
    let what = match kind {
        RunKind::Chirp | RunKind::Control => return Ok(()),
        RunKind::Calibrate => {
            "is the recording of static steps of `bench calibrate`; choose a recording of `bench chirp` or `bench control`"
        }
        RunKind::StageCheck => {
            "is the check of the stage before a closed loop, which is too short for a response; choose a recording of `bench chirp` or `bench control`"
        }
        RunKind::Quiet => {
            "is a run of `bench campaign` without current, which only contains the rest position of the stage; \
             choose a recording of `bench chirp` or `bench control`"
        }
    };
    Err(CliError::Usage(format!("{} {what}", path.display())))
}

/// The analysis, with its progress on a terminal.
fn analysed(
    recording: &Recording,
    signals: ReadSignals,
    config: &Config,
    args: &Args,
) -> Result<AnalysisOutputs, CliError> {
    let path = recording.path();
    let beside = in_folder(args.out.as_deref(), path)?;
    let results = ResultFiles {
        beside: &beside,
        existing: existing_file(&beside, path),
    };
    let progress = Progress::new("analysing");
    let _line = ProgressLine::show(&progress);
    analyse_and_write(
        recording,
        signals,
        config,
        results,
        magnitude_axis(args.order.figures),
        &progress,
    )
}

/// Beside the recording, existing results are its own. In another folder they may be those of a file of the same name.
fn existing_file(beside: &Path, recording: &Path) -> ExistingFile {
    if beside.canonicalize().ok() == recording.canonicalize().ok() {
        ExistingFile::Replace
    } else {
        ExistingFile::Keep
    }
}

impl Report {
    fn new(recording: &Recording, path: &Path, made: AnalysisOutputs) -> Report {
        let outcome = Ending::of(recording);
        Report {
            description: Description::of(recording),
            outcome,
            trip: TripSummary::of(outcome),
            recording: path.display().to_string(),
            ticks: recording.tick_count(),
            overruns: recording.overruns(),
            lost_records: recording.lost_records(),
            truncated: recording.truncated(),
            made,
        }
    }

    /// Whether the run was completed and nothing of it is missing.
    fn is_whole(&self) -> bool {
        self.outcome == Ending::Completed
            && self.overruns + self.lost_records == 0
            && !self.truncated
    }

    /// How the run ended, and its analysis.
    fn text(&self, config: &Config) -> String {
        let period_s = config.servo.period_s();
        let cut = if self.truncated {
            ", the file ends early"
        } else {
            ""
        };
        format!(
            "{}: {} ticks ({:.2} s at {} Hz), {} overruns, {} lost records{cut}\n{}{}{}",
            self.outcome.name().replace('_', " "),
            self.ticks,
            self.ticks as f64 * period_s,
            config.servo.rate_hz,
            self.overruns,
            self.lost_records,
            description_text(&self.description),
            self.trip
                .as_ref()
                .map_or(String::new(), |trip| trip_text(trip, period_s)),
            analysis_output::text(&self.made)
        )
    }
}
