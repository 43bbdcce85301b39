//! `bench report`: one page for one or several recordings.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::error::CliError;
use super::outcome::Outcome;
use super::output::{print_result, print_text};
use crate::experiment::{Plan, RunKind, control_run, overview, step_response};
use crate::identify::{Frf, frf_csv};
use crate::recording::Recording;
use crate::report::ReportError;
use crate::report::run_pages::{ComparedRun, ControlReport, comparison_page};
use crate::util::atomic_file::write_atomic;

/// The page on standard output instead of a file.
const STANDARD_OUTPUT: &str = "-";

/// The recordings, and where the page goes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// Recordings (MCAP) of `bench chirp` and `bench control`
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

/// The page of one closed-loop run, or of one or several recordings in the same plots.
fn page(paths: &[PathBuf]) -> Result<String, CliError> {
    if let [path] = paths
        && let Some(page) = control_page(path)?
    {
        return Ok(page);
    }
    let runs = paths.iter().map(|path| compared_run(path));
    let runs = runs.collect::<Result<Vec<_>, _>>()?;
    comparison_page(&runs).map_err(nothing_common)
}

/// The report of a closed-loop run; `None` for another run.
fn control_page(path: &Path) -> Result<Option<String>, CliError> {
    let recording = Recording::open(path)?;
    let plan = Plan::of(&recording)?;
    if plan.kind != RunKind::Control {
        return Ok(None);
    }
    let run = control_run(&recording, &plan)?;
    let report = ControlReport {
        recording: &recording,
        config: &plan.config,
        run: &run,
    };
    let failed = |error: ReportError| CliError::Failed(error.to_string());
    let plots = report.plots().map_err(failed)?;
    let page = report.page(&plots, frf_beside(path)?.as_ref());
    page.map(Some).map_err(failed)
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
        overview: overview(&recording)?,
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
