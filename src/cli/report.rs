//! `bench report`: the page of a recording, or one page for several recordings.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::analysis_output::shown_by;
use super::error::CliError;
use super::outcome::Outcome;
use super::output::{print_result, print_text};
use super::progress::ProgressLine;
use crate::experiment::{
    AnalysisError, BasicResults, Plan, RunKind, analyse_with_progress, control_run, overview,
    step_response,
};
use crate::identify::{Frf, frf_csv};
use crate::recording::Recording;
use crate::report::ReportError;
use crate::report::run_pages::{
    BasicReport, BenchRun, ComparedRun, ControlReport, comparison_page, page as analysed_page,
    plots,
};
use crate::util::atomic_file::write_atomic;
use crate::util::progress::Progress;

/// The page on standard output instead of a file.
const STANDARD_OUTPUT: &str = "-";

/// The recordings, and where the page goes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// A recording (MCAP) of any run, or several of `bench chirp` and `bench control` for the same plots
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

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let page = page(&args.recordings)?;
    let path = args
        .out
        .clone()
        .unwrap_or_else(|| default_page(&args.recordings[0]));
    if path == Path::new(STANDARD_OUTPUT) {
        print_text(&page)?;
        return Ok(Outcome::Done);
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
    Ok(Outcome::Done)
}

/// The page of one run, or of several recordings in the same plots.
fn page(paths: &[PathBuf]) -> Result<String, CliError> {
    if let [path] = paths {
        return run_page(path);
    }
    let runs = paths.iter().map(|path| compared_run(path));
    let runs = runs.collect::<Result<Vec<_>, _>>()?;
    comparison_page(&runs, None).map_err(nothing_common)
}

/// The page of one run: its analysis, if it is one of an excitation; its loop; or what else it has found.
fn run_page(path: &Path) -> Result<String, CliError> {
    let recording = Recording::open(path)?;
    let plan = Plan::of(&recording)?;
    let page = match (plan.kind, plan.config.control.reference.is_swept()) {
        (RunKind::Chirp, _) | (RunKind::Control, true) => analysis_page(&recording, &plan)?,
        (RunKind::Control, false)
        | (RunKind::Calibrate | RunKind::Quiet | RunKind::StageCheck, _) => Err(String::new()),
    };
    match (page, plan.kind) {
        (Ok(page), _) => Ok(page),
        (Err(_), RunKind::Control) => control_page(&recording, &plan),
        (Err(why), _) => basic_page(&recording, &plan, &why),
    }
}

/// The page of an analysed excitation, or why it cannot be analysed.
fn analysis_page(recording: &Recording, plan: &Plan) -> Result<Result<String, String>, CliError> {
    let progress = Progress::new("analysing");
    let _line = ProgressLine::show(&progress);
    let analysis = match analyse_with_progress(recording, &plan.config, &mut shown_by(&progress)) {
        Ok(analysis) => analysis,
        Err(AnalysisError::Recording(error)) => return Err(error.into()),
        Err(error) => return Ok(Err(error.to_string())),
    };
    let report = BenchRun::new(recording, &analysis, &plan.config).report();
    let report = report.map_err(failed)?;
    let plots = plots(&report).map_err(failed)?;
    Ok(Ok(analysed_page(&report, &plots)))
}

/// The report of a closed-loop run.
fn control_page(recording: &Recording, plan: &Plan) -> Result<String, CliError> {
    let report = ControlReport {
        recording,
        config: &plan.config,
        run: &control_run(recording, plan)?,
    };
    let plots = report.plots().map_err(failed)?;
    let frf = frf_beside(recording.path())?;
    report.page(&plots, frf.as_ref()).map_err(failed)
}

/// The page of a run without a frequency response.
fn basic_page(recording: &Recording, plan: &Plan, why: &str) -> Result<String, CliError> {
    let report = BasicReport {
        recording,
        config: &plan.config,
        results: &BasicResults::of(recording, plan, why),
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
             run `bench identify` on recordings of a chirp first, or give a single recording"
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

/// A recording with its signals, its step and with the frequency response beside it.
fn compared_run(path: &Path) -> Result<ComparedRun, CliError> {
    let recording = Recording::open(path)?;
    let plan = Plan::of(&recording)?;
    let step = match plan.kind {
        RunKind::Control => step_response(&recording, &plan)?,
        RunKind::Chirp | RunKind::Calibrate | RunKind::Quiet | RunKind::StageCheck => None,
    };
    let stem = path.file_stem().unwrap_or_default();
    Ok(ComparedRun {
        name: stem.to_string_lossy().into_owned(),
        frf: frf_beside(path)?,
        step,
    })
}

/// The response that the analysis wrote beside a recording.
fn frf_beside(path: &Path) -> Result<Option<Frf>, CliError> {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let csv = path.with_file_name(format!("{stem}_frf.csv"));
    if !csv.exists() {
        return Ok(None);
    }
    let frf = frf_csv::read(&csv).map_err(|error| CliError::Failed(error.to_string()))?;
    Ok(Some(frf))
}
