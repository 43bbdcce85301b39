//! What a comparison takes from one recording.

use serde::Serialize;

use crate::analysis::{
    Analysis, AnalysisError, AnalysisProgress, Ending, ReadSignals, analyse, cautions,
};
use crate::errors::ExperimentError;
use crate::plan::{Description, Plan, RunKind};
use crate::results::{ControlRun, control_run};
use bench_config::Config;
use bench_identify::modal::{FittedMode, ModalFit};
use bench_identify::verdict::Cnmp;
use bench_recording::Recording;

/// A recorded run with its results.
#[derive(Clone, Debug)]
pub struct RunResult {
    /// Name in legends and tables: that of the run, or of its file.
    pub label: String,
    /// Path of the recording.
    pub recording: String,
    /// Kind of the run.
    pub kind: RunKind,
    /// How the run ended.
    pub outcome: Ending,
    /// Defects of the run that affect its results: it was not completed, or records are lost.
    pub cautions: Vec<String>,
    /// Its settings.
    pub config: Config,
    /// Scheduled ticks that were not served.
    pub overruns: u64,
    /// Records lost between loop and recording.
    pub lost_records: u64,
    /// The analysis of an excitation or of a swept reference.
    pub analysis: Option<Analysis>,
    /// Why an excitation has no analysis.
    pub why: Option<String>,
    /// The figures of a closed loop.
    pub control: Option<ControlRun>,
}

/// The head of a run in the JSON of a comparison.
#[derive(Clone, Debug, Serialize)]
pub struct RunHead {
    /// Name in legends and tables.
    pub label: String,
    /// Path of the recording.
    pub recording: String,
    /// Kind of the run.
    pub run: RunKind,
    /// How it ended.
    pub outcome: Ending,
    /// Verdict on CNMP zeros.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cnmp: Option<Cnmp>,
    /// Signs of the residues, lowest frequency first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub signs: Option<String>,
    /// Why there are no modes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
}

impl RunResult {
    /// Analyses a recording in the way of its kind. A recording without a frequency response states why.
    ///
    /// # Errors
    /// When the recording cannot be read, or was cancelled.
    pub fn of(
        recording: &Recording,
        progress: &mut AnalysisProgress<'_>,
    ) -> Result<RunResult, ExperimentError> {
        let plan = Plan::of(recording)?;
        let is_loop = plan.kind == RunKind::Control;
        let is_swept = is_loop && plan.config.control.reference.is_swept();
        let (analysis, why) = if plan.kind == RunKind::Chirp || is_swept {
            analysed(recording, &plan.config, progress)?
        } else {
            (None, None)
        };
        Ok(RunResult {
            label: label(recording),
            recording: recording.path().display().to_string(),
            kind: plan.kind,
            outcome: Ending::of(recording),
            cautions: cautions(recording),
            overruns: recording.overruns(),
            lost_records: recording.lost_records(),
            analysis,
            why,
            control: if is_loop {
                Some(control_run(recording, &plan)?)
            } else {
                None
            },
            config: plan.config,
        })
    }

    /// The fitted modes, if there are any.
    pub fn fit(&self) -> Option<&ModalFit> {
        self.analysis.as_ref()?.fit.as_ref().ok()
    }

    /// The run for JSON.
    pub(super) fn head(&self) -> RunHead {
        let analysis = self.analysis.as_ref();
        let fit = self.fit();
        RunHead {
            label: self.label.clone(),
            recording: self.recording.clone(),
            run: self.kind,
            outcome: self.outcome,
            cnmp: analysis.map(|analysis| analysis.verdict.cnmp),
            signs: fit.map(|fit| fit.modes().iter().map(FittedMode::sign).collect()),
            why: self.why.clone(),
        }
    }
}

/// The analysis, or why there is none.
fn analysed(
    recording: &Recording,
    config: &Config,
    progress: &mut AnalysisProgress<'_>,
) -> Result<(Option<Analysis>, Option<String>), ExperimentError> {
    match analyse(recording, ReadSignals::default(), config, progress) {
        Ok(analysis) => {
            let why = analysis.fit.as_ref().err().map(ToString::to_string);
            Ok((Some(analysis), why))
        }
        Err(error @ (AnalysisError::Recording(_) | AnalysisError::Cancelled)) => Err(error.into()),
        Err(error) => Ok((None, Some(error.to_string()))),
    }
}

/// The name of the run, or that of its file without ending.
fn label(recording: &Recording) -> String {
    let stem = recording.path().file_stem().unwrap_or_default();
    let name = Description::of(recording).name;
    name.unwrap_or_else(|| stem.to_string_lossy().into_owned())
}

/// Makes labels different that are equal, by the paths of the recordings.
pub fn distinguish(runs: &mut [RunResult]) {
    let labels: Vec<String> = runs.iter().map(|run| run.label.clone()).collect();
    for run in runs {
        let equal = labels.iter().filter(|label| **label == run.label);
        if equal.count() > 1 {
            run.label = format!("{} ({})", run.label, run.recording);
        }
    }
}
