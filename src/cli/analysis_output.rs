//! The analysis of a recording, as text.

use core::ops::ControlFlow;
use std::path::{Path, PathBuf};

use super::error::CliError;
use super::exit::Exit;
use super::run_options::exit;
use super::table::wrap;
use super::{linearity_output, loop_output, modal_output};
use bench_base::decimal::Decimal;
use bench_base::progress::Progress;
use bench_config::Config;
use bench_experiment::certificate::{SIGNS_DIFFER, SignCheck};
use bench_experiment::outputs::{AnalysisOutputs, OutputError, PageFiles, ResultFiles};
use bench_experiment::{
    AnalysedRun, AnalysisPhase, ReadSignals, RunSummary, analyse, open_with_signals,
};
use bench_recording::Recording;
use bench_report::MagnitudeAxis;
use bench_report::run_pages::{BenchRun, PageError, write_page};

impl From<OutputError> for CliError {
    fn from(error: OutputError) -> Self {
        CliError::Failed(error.to_string())
    }
}

impl From<PageError> for CliError {
    fn from(error: PageError) -> Self {
        CliError::Failed(error.to_string())
    }
}

/// Steps of the progress of an analysis.
const STEPS: u64 = 1000;

/// Analyses a recording and writes the result files.
pub(super) fn analyse_and_write(
    recording: &Recording,
    signals: ReadSignals,
    config: &Config,
    results: ResultFiles<'_>,
    magnitude_axis: MagnitudeAxis,
    progress: &Progress,
) -> Result<AnalysisOutputs, CliError> {
    progress.begin("analysing", STEPS);
    let analysis = analyse(recording, signals, config, &mut shown_by(progress))?;
    let run = AnalysedRun::new(recording, &analysis, config);
    let page = BenchRun::new(recording, &analysis, config).with_magnitude_axis(magnitude_axis);
    write_results(&run, &page, results)
}

/// Writes the results of an analysed run, and its plots and page.
pub(super) fn write_results(
    run: &AnalysedRun<'_>,
    page: &BenchRun<'_>,
    results: ResultFiles<'_>,
) -> Result<AnalysisOutputs, CliError> {
    let outputs = AnalysisOutputs::write(run, results)?;
    let report = page.report().map_err(PageError::from)?;
    Ok(outputs.with_pages(write_page(&report, results)?))
}

/// As [`analyse_and_write`], of a recording that is not open yet.
pub(super) fn open_analyse_and_write(
    path: &Path,
    config: &Config,
    results: ResultFiles<'_>,
    magnitude_axis: MagnitudeAxis,
    progress: &Progress,
) -> Result<AnalysisOutputs, CliError> {
    let (recording, signals) = open_with_signals(path)?;
    analyse_and_write(
        &recording,
        signals,
        config,
        results,
        magnitude_axis,
        progress,
    )
}

/// A receiver of the progress of an analysis that never cancels it.
pub(super) fn shown_by(progress: &Progress) -> impl FnMut(AnalysisPhase, f64) -> ControlFlow<()> {
    move |phase, fraction| {
        let done = (phase.overall(fraction) * STEPS as f64) as u64;
        progress.set(done, STEPS);
        ControlFlow::Continue(())
    }
}

/// The outcome of a run with its analysis.
pub(super) fn analysis_exit(run: &RunSummary, outputs: &AnalysisOutputs) -> Exit {
    if outputs.is_cancelled() {
        Exit::Failed
    } else {
        exit(run)
    }
}

/// A failed analysis of a run, with the state of its recording.
pub(super) fn analysis_failed(error: &CliError, recording: &Path) -> CliError {
    let path = recording.display();
    let state = if recording.exists() {
        "is complete"
    } else {
        "was removed"
    };
    CliError::Failed(format!("{error}; the recording of the run {state}: {path}"))
}

/// Files, delay, modes, zeros and verdict.
pub(super) fn text(outputs: &AnalysisOutputs) -> String {
    let (Some(frf_csv), Some(coherence)) = (&outputs.frf_csv, outputs.coherence_median) else {
        let why = &outputs.summary.why;
        return wrap(&format!("no frequency response: {why}"), 2);
    };
    let filled = match outputs.filled_ticks {
        0 => String::new(),
        ticks => format!(", positions of {ticks} missing ticks estimated"),
    };
    let response = response_text(frf_csv, outputs.frequencies, coherence);
    let closed = outputs.closed.as_ref().map(loop_output::text);
    let linearity = outputs.linearity.as_ref().map(linearity_output::line);
    [
        format!("{response}{filled}\n"),
        closed.unwrap_or_default(),
        delay_text(outputs),
        linearity.unwrap_or_default(),
        certificate_text(outputs.certificate.as_deref()),
        pages_text(&outputs.pages),
        modal_output::text(&outputs.summary, "1/kg"),
        outputs.signs.as_ref().map_or(String::new(), signs_text),
    ]
    .concat()
}

/// The file of a response and its size.
pub(super) fn response_text(frf_csv: &str, frequencies: usize, coherence: f64) -> String {
    format!(
        "  response   {frf_csv}\n             {frequencies} frequencies, median coherence {coherence:.4}"
    )
}

fn certificate_text(path: Option<&str>) -> String {
    path.map_or(String::new(), |path| format!("  evidence   {path}\n"))
}

/// A warning in large letters, if the signs of the residues differ from those of the model.
fn signs_text(signs: &SignCheck) -> String {
    if !signs.differ() {
        return String::new();
    }
    let (line, measured, model) = ("*".repeat(80), &signs.measured, &signs.model);
    let heading = format!(
        "THE SIGNS OF THE RESIDUES DIFFER FROM THE MODEL: MEASURED {measured}, MODEL {model}"
    );
    let text = wrap(&heading, 2) + &wrap(SIGNS_DIFFER, 2);
    format!("\n{line}\n{text}{line}\n")
}

/// The delay, and the file of the response without it.
fn delay_text(outputs: &AnalysisOutputs) -> String {
    let without = outputs.frf_without_delay_csv.as_deref().unwrap_or_default();
    let without = format!("  no delay   {without}\n");
    let (Some(delay_s), Some(excess_s), Some(sigma_s)) = (
        outputs.delay_s,
        outputs.delay_beyond_model_s,
        outputs.delay_beyond_model_sigma_s,
    ) else {
        return without;
    };
    format!(
        "  delay      {:.3} ms from command to reading: {:.3} ms as configured,\n             {:+.4} ± {:.4} ms in addition, from the phases\n{without}",
        Decimal((delay_s + excess_s) * 1e3),
        delay_s * 1e3,
        Decimal(excess_s * 1e3),
        2.0 * sigma_s * 1e3
    )
}

/// A line for each plot, and one for the page.
pub(super) fn pages_text(pages: &PageFiles) -> String {
    let plot = |path: &String| format!("  plot       {path}\n");
    let plots: String = pages.plots.values().flatten().map(plot).collect();
    let report = |path: &String| format!("  report     {path}\n");
    plots + &pages.report.as_ref().map_or(String::new(), report)
}

/// `path` moved to a folder, which is created if necessary; `path` itself without a folder.
pub(super) fn in_folder(folder: Option<&Path>, path: &Path) -> Result<PathBuf, CliError> {
    let Some(folder) = folder else {
        return Ok(path.to_owned());
    };
    let failed = |e| {
        CliError::Failed(format!(
            "cannot create the folder {}: {e}; choose another folder with --out",
            folder.display()
        ))
    };
    std::fs::create_dir_all(folder).map_err(failed)?;
    Ok(folder.join(path.file_name().unwrap_or_default()))
}
