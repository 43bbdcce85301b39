//! The excitation of a recorded run, and the estimate of its response.

use super::analysis_error::AnalysisError;
use super::closed_responses::estimate_loop;
use super::missing_ticks::{MAX_RATIO_OF_LOOP, MAX_RATIO_ON_LINES, MissingTicks, shortest_window};
use super::read_run::is_closed_loop;
use super::response_estimate::ResponseEstimate;
use super::run_signals::RunSignals;
use super::segments::{Segments, segments};
use super::swept_band::{SweptBand, SweptBy, swept_band};
use bench_config::Config;
use bench_excitation::Pattern;
use bench_identify::joint::LoopSignals;
use bench_identify::{Signals, response};
use bench_recording::Recording;
use std::borrow::Cow;

/// A recorded run with its excitation.
pub(super) struct ExcitedRun<'a> {
    recording: &'a Recording,
    config: &'a Config,
    missing: MissingTicks,
    excitation: RunExcitation,
    swept: SweptBand,
}

/// How a run was excited.
enum RunExcitation {
    /// By the reference of a closed loop.
    Reference,
    /// By a current.
    Current(Pattern),
}

impl<'a> ExcitedRun<'a> {
    pub(super) fn new(
        recording: &'a Recording,
        config: &'a Config,
        missing: &MissingTicks,
    ) -> Result<ExcitedRun<'a>, AnalysisError> {
        let excitation = if is_closed_loop(recording.metadata()) {
            RunExcitation::Reference
        } else {
            RunExcitation::Current(config.chosen_excitation()?.pattern())
        };
        let swept_by = match &excitation {
            RunExcitation::Reference => SweptBy::Reference,
            RunExcitation::Current(pattern) => SweptBy::Current(pattern),
        };
        let swept = swept_band(recording, config, &swept_by, missing.ticks)?;
        Ok(ExcitedRun {
            recording,
            config,
            missing: missing.clone(),
            excitation,
            swept,
        })
    }

    /// How often the positions in missing ticks are to be predicted. The lines of a periodic excitation are estimated from its periods,
    /// which missing ticks lengthen.
    pub(super) fn predictions(&self) -> usize {
        if self.has_lines() {
            0
        } else {
            self.missing.rounds()
        }
    }

    /// Fails if there are too many missing ticks for positions on straight lines.
    pub(super) fn check_positions_on_lines(&self) -> Result<(), AnalysisError> {
        self.missing.check_ratio(MAX_RATIO_ON_LINES)
    }

    /// The factor by which missing ticks increase the variances; fails if there are too many.
    pub(super) fn variance_factor(&self) -> Result<f64, AnalysisError> {
        if self.has_lines() {
            self.check_positions_on_lines()?;
            return Ok(1.0);
        }
        if matches!(self.excitation, RunExcitation::Reference) {
            self.missing.check_ratio(MAX_RATIO_OF_LOOP)?;
        }
        let record_s = self.missing.ticks as f64 * self.config.servo.period_s();
        // Without the rest at both ends, and not more than was recorded.
        let duration_s = record_s.min(self.config.chirp.duration_s);
        let window = shortest_window(self.config, self.swept.band_hz, duration_s);
        self.missing.variance_factor(window)
    }

    /// Whether the response is estimated at single frequencies from periods.
    fn has_lines(&self) -> bool {
        matches!(
            self.excitation,
            RunExcitation::Current(Pattern::Periodic { .. } | Pattern::Stepped(_))
        )
    }

    /// The responses by the signals of the run.
    pub(super) fn estimate(&self, signals: &RunSignals) -> Result<ResponseEstimate, AnalysisError> {
        let signals = &self.faded(&signals.loop_signals);
        match &self.excitation {
            RunExcitation::Reference => {
                estimate_loop(signals, self.swept.band_hz, self.recording, self.config)
            }
            // Repetitions with missing ticks are not equal: they are estimated as one record.
            RunExcitation::Current(Pattern::Repeated { .. }) if !self.missing.is_empty() => {
                self.open_loop(signals.signals.clone(), &Pattern::Once)
            }
            RunExcitation::Current(pattern) => self.open_loop(signals.signals.clone(), pattern),
        }
    }

    /// The signals, faded out if their sweep ended early.
    fn faded<'s>(&self, signals: &'s LoopSignals) -> Cow<'s, LoopSignals> {
        let Some(fade_out) = &self.swept.fade_out else {
            return Cow::Borrowed(signals);
        };
        let excitation = match self.excitation {
            RunExcitation::Reference => &signals.reference_m,
            RunExcitation::Current(_) => &signals.signals.input,
        };
        Cow::Owned(fade_out.applied(signals, excitation))
    }

    fn open_loop(
        &self,
        signals: Signals,
        pattern: &Pattern,
    ) -> Result<ResponseEstimate, AnalysisError> {
        let settings = &self.config.identify;
        let (frf, linearity) = match segments(signals, pattern, self.swept.band_hz)? {
            Segments::Lines(frf, linearity) => (frf, linearity.map(|boxed| *boxed)),
            Segments::Record(signals) => (response(&signals, self.swept.band_hz, settings)?, None),
        };
        Ok(ResponseEstimate {
            frf,
            closed: None,
            linearity,
        })
    }
}
