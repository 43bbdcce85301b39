//! What is made from the recording of an excitation: the frequency response as CSV, its pictures, and the page of the run.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::error::CliError;
use super::linearity_output;
use super::loop_output::LoopMade;
use super::modal_output::ModalSummary;
use crate::config::Config;
use crate::experiment::{AnalysisError, analyse};
use crate::identify::frf_csv::{self, METRES_PER_AMPERE};
use crate::identify::linearity::Linearity;
use crate::identify::modal::{FittedMode, ModalFit};
use crate::recording::Recording;
use crate::report::run_pages::{PLOT_KINDS, ReportSource, RunReport, page, pictures};

/// The files that were made and what the response shows; `null` where the run gave no response.
#[derive(Clone, Debug, Serialize)]
pub(super) struct AnalysisOutputs {
    frf_csv: Option<String>,
    /// The same with the delay, measured as below, taken out of the phases.
    frf_without_delay_csv: Option<String>,
    /// The Bode plot.
    plot: Option<String>,
    /// All pictures by name; `null` where the data carry none.
    plots: Plots,
    /// The page of the run.
    pub report: Option<String>,
    frequencies: usize,
    /// Median coherence over the band.
    coherence_median: Option<f64>,
    filled_ticks: u64,
    /// Mean time from a command to the position that its reading shows, by the model.
    delay_s: Option<f64>,
    /// How much later than the model the measured response answers, and its standard deviation.
    delay_beyond_model_s: Option<f64>,
    delay_beyond_model_sigma_s: Option<f64>,
    #[serde(flatten)]
    summary: ModalSummary,
    /// The loop around the plant, where it was closed.
    #[serde(rename = "loop", skip_serializing_if = "Option::is_none")]
    closed: Option<LoopMade>,
    /// Distortion and noise, where a multisine left lines out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub linearity: Option<Linearity>,
    /// The modes as fitted, to be compared with those of other runs.
    #[serde(skip)]
    pub fitted: Vec<FittedMode>,
}

/// Why nothing was made: a person wished so.
const STOPPED: &str =
    "stopped before the analysis was done; the recording is whole: `bench identify` analyses it";

impl From<AnalysisError> for CliError {
    fn from(error: AnalysisError) -> Self {
        CliError::Failed(error.to_string())
    }
}

/// Analyses a recording; the files stand beside a path, that of the recording or another, under its name.
pub(super) fn make(
    recording: &Recording,
    config: &Config,
    beside: &Path,
) -> Result<AnalysisOutputs, CliError> {
    let analysis = &analyse(recording, config)?;
    let csv_path = free(beside, "frf", "csv");
    frf_csv::write_new(&csv_path, &analysis.frf, METRES_PER_AMPERE)
        .map_err(|e| CliError::Failed(e.to_string()))?;
    let plain_path = free(beside, "frf_without_delay", "csv");
    let plain = analysis.frf.without_delay(analysis.measured_delay_s());
    frf_csv::write_new(&plain_path, &plain, METRES_PER_AMPERE)
        .map_err(|e| CliError::Failed(e.to_string()))?;
    let run = RunReport {
        analysis,
        config,
        recording,
    };
    let Drawn { plots, report } = drawn(&run, beside)?;
    Ok(AnalysisOutputs {
        frf_csv: Some(csv_path.display().to_string()),
        frf_without_delay_csv: Some(plain_path.display().to_string()),
        plot: plots.get("bode").cloned().flatten(),
        plots,
        report: Some(report),
        frequencies: analysis.frf.len(),
        coherence_median: analysis.frf.median_coherence(),
        filled_ticks: analysis.filled_ticks,
        delay_s: Some(analysis.delay_s),
        delay_beyond_model_s: analysis.excess_delay.map(|delay| delay.value),
        delay_beyond_model_sigma_s: analysis.excess_delay.map(|delay| delay.sigma),
        summary: ModalSummary::new(analysis.fit.as_ref().ok(), &analysis.verdict),
        closed: analysis
            .closed
            .as_ref()
            .map(|closed| LoopMade::of(closed, beside))
            .transpose()?,
        linearity: analysis.linearity.clone(),
        fitted: analysis.fit.as_ref().map_or(Vec::new(), ModalFit::modes),
    })
}

impl AnalysisOutputs {
    /// Nothing was made.
    pub fn nothing(why: &str) -> AnalysisOutputs {
        AnalysisOutputs {
            frf_csv: None,
            frf_without_delay_csv: None,
            plot: None,
            plots: no_plots(),
            report: None,
            frequencies: 0,
            coherence_median: None,
            filled_ticks: 0,
            delay_s: None,
            delay_beyond_model_s: None,
            delay_beyond_model_sigma_s: None,
            summary: ModalSummary::none(why),
            closed: None,
            linearity: None,
            fitted: Vec::new(),
        }
    }

    /// A person stopped the analysis.
    pub fn stopped() -> AnalysisOutputs {
        AnalysisOutputs::nothing(STOPPED)
    }

    pub fn is_stopped(&self) -> bool {
        self.summary.why() == STOPPED
    }

    pub fn text(&self) -> String {
        let (Some(frf_csv), Some(report), Some(coherence)) =
            (&self.frf_csv, &self.report, self.coherence_median)
        else {
            return format!("  no frequency response: {}\n", self.summary.why());
        };
        let filled = if self.filled_ticks > 0 {
            format!(", {} missing ticks filled in", self.filled_ticks)
        } else {
            String::new()
        };
        let delay = match (
            self.delay_s,
            self.delay_beyond_model_s,
            self.delay_beyond_model_sigma_s,
        ) {
            (Some(delay_s), Some(beyond_s), Some(sigma_s)) => format!(
                "  delay      {:.3} ms from command to reading: {:.3} ms by the configuration, {:+.4} +- {:.4} ms beyond by the phases\n",
                (delay_s + beyond_s) * 1e3,
                delay_s * 1e3,
                beyond_s * 1e3,
                2.0 * sigma_s * 1e3
            ),
            _ => String::new(),
        };
        format!(
            "  response   {} ({} frequencies, median coherence {:.4}{filled})\n{}{delay}  without    {}, the same with that delay taken out of its phases\n{}{}  report     {report}\n{}",
            frf_csv,
            self.frequencies,
            coherence,
            self.closed.as_ref().map_or(String::new(), LoopMade::text),
            self.frf_without_delay_csv.as_deref().unwrap_or_default(),
            self.linearity
                .as_ref()
                .map_or(String::new(), linearity_output::line),
            plots_text(&self.plots),
            self.summary.text()
        )
    }
}

/// Pictures by name; `null` where the data carry none.
pub(super) type Plots = BTreeMap<&'static str, Option<String>>;

/// The pictures of a record and its page.
pub(super) struct Drawn {
    pub(super) plots: Plots,
    pub(super) report: String,
}

/// Draws a record; the files stand beside a path under its name.
pub(super) fn drawn(record: &dyn ReportSource, beside: &Path) -> Result<Drawn, CliError> {
    let pictures = pictures(record).map_err(|e| CliError::Failed(e.to_string()))?;
    let mut plots = no_plots();
    for picture in &pictures {
        let path = free(beside, picture.kind, "svg");
        write_new(&path, &picture.svg)?;
        plots.insert(picture.kind, Some(path.display().to_string()));
    }
    let report = free(beside, "report", "html");
    write_new(&report, &page(record, &pictures))?;
    Ok(Drawn {
        plots,
        report: report.display().to_string(),
    })
}

/// A line for each picture.
pub(super) fn plots_text(plots: &Plots) -> String {
    plots
        .values()
        .flatten()
        .map(|path| format!("  plot       {path}\n"))
        .collect()
}

/// Every name, and no picture.
fn no_plots() -> Plots {
    PLOT_KINDS.into_iter().map(|kind| (kind, None)).collect()
}

/// The path under which a file would stand in a folder, which is made if it is not there; without one its own.
pub(super) fn in_folder(folder: Option<&Path>, path: &Path) -> Result<PathBuf, CliError> {
    let Some(folder) = folder else {
        return Ok(path.to_owned());
    };
    let failed = |e| CliError::Failed(format!("cannot make the folder {}: {e}", folder.display()));
    std::fs::create_dir_all(folder).map_err(failed)?;
    Ok(folder.join(path.file_name().unwrap_or_default()))
}

/// `NAME_what.ext` beside the recording, with -2, -3, ... where that is taken.
pub(super) fn free(recording: &Path, what: &str, extension: &str) -> PathBuf {
    let stem = recording.file_stem().unwrap_or_default().to_string_lossy();
    let numbered = |n: u32| {
        if n == 1 {
            String::new()
        } else {
            format!("-{n}")
        }
    };
    let path =
        |n: u32| recording.with_file_name(format!("{stem}_{what}{}.{extension}", numbered(n)));
    (1..)
        .map(path)
        .find(|path| !path.exists())
        .unwrap_or_else(|| path(1))
}

pub(super) fn write_new(path: &Path, text: &str) -> Result<(), CliError> {
    let failed = |e: std::io::Error| {
        CliError::Failed(format!(
            "cannot write {}: {e}; free some space or choose another folder",
            path.display()
        ))
    };
    std::fs::File::create_new(path)
        .and_then(|mut file| file.write_all(text.as_bytes()))
        .map_err(failed)
}
