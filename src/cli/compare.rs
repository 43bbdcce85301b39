//! `bench compare`: recorded runs beside a reference run, with the significance of their differences.

use std::path::{Path, PathBuf};

use serde::Serialize;

use super::analysis_output::shown_by;
use super::compare_output::text;
use super::error::CliError;
use super::exit::Exit;
use super::identify::warn_of_unchecked;
use super::output::{print_result, warn};
use super::progress::ProgressLine;
use bench_base::atomic_file::write_atomic;
use bench_base::progress::Progress;
use bench_experiment::run_comparison::{Comparison, RunResult, distinguish};
use bench_recording::Recording;
use bench_report::ReportError;
use bench_report::run_pages::{MAX_COMPARED, comparison_page};

/// The recordings, and where the page goes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    /// 2 to 12 recordings (MCAP) of `bench chirp` or `bench control`; the others are compared with the first
    #[arg(required = true, num_args = 2..)]
    recordings: Vec<PathBuf>,
    /// Write a page with plots and tables
    #[arg(long, value_name = "PAGE")]
    out: Option<PathBuf>,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    json: bool,
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    comparison: Comparison,
    page: Option<String>,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let runs = results(&args.recordings)?;
    let comparison = Comparison::of(&runs).map_err(|error| CliError::Usage(error.to_string()))?;
    let page = args.out.as_deref();
    let page = page.map(|path| write_page(path, &runs, &comparison));
    let report = Report {
        page: page.transpose()?,
        comparison,
    };
    let cautions: Vec<String> = runs.iter().flat_map(cautions).collect();
    warn(&cautions);
    print_result(args.json, &report, |report| {
        text(&report.comparison, report.page.as_deref())
    })?;
    Ok(if cautions.is_empty() {
        Exit::Done
    } else {
        Exit::Impaired
    })
}

/// The defects of a run, with the path of its recording.
fn cautions(run: &RunResult) -> Vec<String> {
    let path = &run.recording;
    let cautions = run.cautions.iter();
    cautions
        .map(|caution| format!("{path}: {caution}"))
        .collect()
}

/// Reads and analyses the recordings, with progress on a terminal. Their labels are different.
pub(super) fn results(paths: &[PathBuf]) -> Result<Vec<RunResult>, CliError> {
    if paths.len() > MAX_COMPARED {
        return Err(CliError::Usage(format!(
            "{} recordings are given, but the curves of more than {MAX_COMPARED} cannot be distinguished; give at most \
             {MAX_COMPARED}",
            paths.len()
        )));
    }
    let progress = Progress::new("analysing");
    let _line = ProgressLine::show(&progress);
    let results = paths.iter().map(|path| result(path, &progress));
    let mut results = results.collect::<Result<Vec<_>, _>>()?;
    distinguish(&mut results);
    Ok(results)
}

fn result(path: &Path, progress: &Progress) -> Result<RunResult, CliError> {
    let recording = Recording::open(path)?;
    warn_of_unchecked(&recording);
    Ok(RunResult::of(&recording, &mut shown_by(progress))?)
}

/// Writes the page and returns its path.
fn write_page(
    path: &Path,
    runs: &[RunResult],
    comparison: &Comparison,
) -> Result<String, CliError> {
    let failed = |error: ReportError| CliError::Failed(error.to_string());
    let page = comparison_page(runs, Some(comparison)).map_err(failed)?;
    let shown = path.display().to_string();
    write_atomic(path, &page).map_err(|error| {
        CliError::Failed(format!(
            "cannot write {shown}: {error}; choose another file with --out"
        ))
    })?;
    Ok(shown)
}
