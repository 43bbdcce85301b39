//! `bench report`: the page of a recording, or one page for several recordings.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::analysis_output::shown_by;
use super::compare::results;
use super::error::CliError;
use super::exit::Exit;
use super::output::{print_result, print_text};
use super::progress::ProgressLine;
use bench_base::atomic_file::write_atomic;
use bench_base::progress::Progress;
use bench_config::Config;
use bench_experiment::run_comparison::RunResult;
use bench_experiment::{Analysis, BasicResults, ControlRun, overview};
use bench_recording::Recording;
use bench_report::ReportError;
use bench_report::run_pages::{
    BasicReport, BenchRun, ControlReport, comparison_page, page as analysed_page, plots,
};

/// The page on standard output instead of a file.
const STANDARD_OUTPUT: &str = "-";

/// The recordings, and where the page goes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// A recording (MCAP) of any run, or up to 12 of `bench chirp` and `bench control` for the same plots
    #[arg(required = true)]
    recordings: Vec<PathBuf>,
    /// Path of the page; `-` prints it [default: the first recording with the ending _plots.html]
    #[arg(long, value_name = "FILE", conflicts_with = "json")]
    out: Option<PathBuf>,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    json: bool,
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    recordings: Vec<String>,
    page: String,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let page = page(&args.recordings)?;
    let path = args
        .out
        .clone()
        .unwrap_or_else(|| default_page(&args.recordings[0]));
    if path == Path::new(STANDARD_OUTPUT) {
        print_text(&page)?;
        return Ok(Exit::Done);
    }
    write_atomic(&path, &page).map_err(|error| {
        let path = path.display();
        CliError::Failed(format!(
            "cannot write {path}: {error}; choose another file with --out"
        ))
    })?;
    let recordings = args.recordings.iter();
    let report = Report {
        recordings: recordings.map(|path| path.display().to_string()).collect(),
        page: path.display().to_string(),
    };
    print_result(args.json, &report, |report| {
        format!("page       {}\n", report.page)
    })?;
    Ok(Exit::Done)
}

/// The page of one run, or of several recordings in the same plots.
fn page(paths: &[PathBuf]) -> Result<String, CliError> {
    match paths {
        [path] => run_page(path),
        paths => comparison_page(&results(paths)?, None).map_err(nothing_common),
    }
}

/// The page of one run: its analysis, if it is one of an excitation; its loop; or what else it has found.
fn run_page(path: &Path) -> Result<String, CliError> {
    let recording = Recording::open(path)?;
    let progress = Progress::new("analysing");
    let _line = ProgressLine::show(&progress);
    let run = RunResult::of(&recording, &mut shown_by(&progress))?;
    match (&run.analysis, &run.control) {
        (Some(analysis), _) => analysis_page(&recording, &run.config, analysis),
        (None, Some(control)) => control_page(&recording, &run.config, control),
        (None, None) => basic_page(&recording, &run),
    }
}

/// The page of an analysed excitation.
fn analysis_page(
    recording: &Recording,
    config: &Config,
    analysis: &Analysis,
) -> Result<String, CliError> {
    let report = BenchRun::new(recording, analysis, config).report();
    let report = report.map_err(failed)?;
    let plots = plots(&report).map_err(failed)?;
    Ok(analysed_page(&report, &plots))
}

/// The page of a closed-loop run.
fn control_page(
    recording: &Recording,
    config: &Config,
    run: &ControlRun,
) -> Result<String, CliError> {
    let report = ControlReport {
        recording,
        config,
        run,
    };
    let plots = report.plots().map_err(failed)?;
    Ok(report.page(&plots))
}

/// The page of a run without a frequency response.
fn basic_page(recording: &Recording, run: &RunResult) -> Result<String, CliError> {
    let why = run.why.as_deref().unwrap_or_default();
    let report = BasicReport {
        recording,
        config: &run.config,
        results: &BasicResults::of(recording, run.kind, &run.config, why),
        overview: &overview(recording)?,
    };
    report.page().map_err(failed)
}

fn failed(error: ReportError) -> CliError {
    CliError::Failed(error.to_string())
}

fn nothing_common(error: ReportError) -> CliError {
    let text = match error {
        ReportError::NoTrace => {
            "the recordings have neither steps nor frequency responses that one plot could show; \
             give recordings of `bench chirp` or of steps of `bench control`, or a single recording"
                .into()
        }
        error => error.to_string(),
    };
    CliError::Failed(text)
}

fn default_page(recording: &Path) -> PathBuf {
    let stem = recording.file_stem().unwrap_or_default().to_string_lossy();
    recording.with_file_name(format!("{stem}_plots.html"))
}
