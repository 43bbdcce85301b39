//! The data of all shots.

use std::path::Path;

use crate::analysis::{
    Analysis, AnalysisError, ModalStep, ResponseEstimate, cautions, estimated, never_cancels,
    open_with_signals, run_signals_of,
};
use bench_config::Config;
use bench_identify::verdict::Certainty;
use bench_identify::{Frf, best_of};

/// The responses of the shots.
#[derive(Default)]
pub(super) struct Evidence {
    frfs: Vec<Frf>,
    /// The best points and the data of all shots.
    pub(super) frf: Frf,
    filled_ticks: u64,
    /// Defects of the runs.
    cautions: Vec<String>,
}

impl Evidence {
    /// Adds the recording of a shot.
    ///
    /// # Errors
    /// When the recording cannot be read, or contains no frequency response.
    pub(super) fn add(&mut self, recording: &Path, config: &Config) -> Result<(), AnalysisError> {
        let (recording, signals) = open_with_signals(recording)?;
        let signals = run_signals_of(&recording, signals, config, &mut never_cancels)?;
        self.filled_ticks += signals.filled_ticks();
        let estimate = estimated(&recording, signals, config, &mut never_cancels)?;
        self.frfs.push(estimate.frf);
        self.cautions.extend(cautions(&recording));
        self.frf = best_of(&self.frfs);
        Ok(())
    }

    /// Fit and verdict of all data so far.
    ///
    /// # Errors
    /// When the model of the plant cannot be analysed.
    pub(super) fn analysis(&self, config: &Config) -> Result<Analysis, AnalysisError> {
        let estimate = ResponseEstimate {
            frf: self.frf.clone(),
            closed: None,
            linearity: None,
        };
        let step = ModalStep {
            config,
            certainty: Certainty::REPEATED_LOOKS,
        };
        let mut analysis = step.of(estimate, self.filled_ticks, &mut never_cancels)?;
        for caution in &self.cautions {
            analysis.verdict = analysis.verdict.with(Some(caution.clone()));
        }
        Ok(analysis)
    }
}
