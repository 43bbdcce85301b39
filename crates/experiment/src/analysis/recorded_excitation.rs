//! The analysis of a recorded excitation: one function for all commands.

use core::ops::ControlFlow;
use std::f64::consts::TAU;

use nalgebra::Complex;

use super::analysis_error::AnalysisError;
use super::ending::Ending;
use super::excited_run::ExcitedRun;
use super::missing_ticks;
use super::model_response::ModelResponse;
use super::read_run::{ReadSignals, is_closed_loop, is_of_run};
use super::response_estimate::{ClosedResponses, ResponseEstimate};
use super::run_signals::RunSignals;
use super::signal_builder::SignalBuilder;
use crate::certificate::SignCheck;
use bench_config::Config;
use bench_identify::delay::excess_delay;
use bench_identify::linearity::Linearity;
use bench_identify::modal::{self, FitError, MeasurementChain, ModalFit};
use bench_identify::verdict::{Certainty, Verdict, VerdictScope, judge};
use bench_identify::{Estimate, Frf, Signals};
use bench_plant::{ModalModel, Mode, Sign, SignalPath};
use bench_recording::Recording;

/// The phase of the model is used, and a verdict is given, up to this multiple of its highest mode.
const LAST_MODE: f64 = 1.2;
/// Progress is reported after this many ticks.
const TICKS_PER_REPORT: usize = 1 << 15;

/// The analysis of a recorded excitation.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// The frequency response from the commanded current (A) to the measured position (m). It includes hold, amplifier, plant,
    /// delays, and the mean age of the readings; differences of their ages are corrected.
    pub frf: Frf,
    /// The response of the model at the same frequencies, for readings of the mean age.
    pub model: Vec<Complex<f64>>,
    /// The model at other frequencies.
    pub model_response: ModelResponse,
    /// Mean time in seconds from a command to the position in the reading, by the model.
    pub delay_s: f64,
    /// Excess delay over the model in seconds, from the phases up to the last mode of the model.
    pub excess_delay: Option<Estimate>,
    /// Number of missing ticks. The amplifier held its current in them, and their positions are those of the fitted modes.
    pub filled_ticks: u64,
    /// The fitted modes, or why none can be fitted.
    pub fit: Result<ModalFit, FitError>,
    /// The signs of the residues beside those of the model; `None` if no modes can be fitted.
    pub signs: Option<SignCheck>,
    /// The verdict on CNMP zeros.
    pub verdict: Verdict,
    /// The verdict covers modes and zeros up to here, in rad/s.
    pub judged_up_to_rad_s: f64,
    /// The responses of the loop, if the recording is of a closed loop.
    pub closed: Option<ClosedResponses>,
    /// Noise and distortion, if the excitation is a multisine that omits lines.
    pub linearity: Option<Linearity>,
}

/// A part of the analysis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AnalysisPhase {
    /// The ticks are read.
    Reading,
    /// The frequency response is estimated.
    Response,
    /// The modes are fitted.
    Modes,
}

impl AnalysisPhase {
    /// Progress of the whole analysis, 0 to 1, at a progress of the phase.
    pub fn overall(self, fraction: f64) -> f64 {
        let (begin, end) = match self {
            AnalysisPhase::Reading => (0.0, 0.1),
            AnalysisPhase::Response => (0.1, 0.3),
            AnalysisPhase::Modes => (0.3, 1.0),
        };
        begin + (end - begin) * fraction
    }
}

/// Receives the progress of each phase, 0 to 1; `Break` cancels the analysis.
pub type AnalysisProgress<'a> = dyn FnMut(AnalysisPhase, f64) -> ControlFlow<()> + 'a;

/// A receiver of progress that ignores it and never cancels.
pub fn never_cancels(_: AnalysisPhase, _: f64) -> ControlFlow<()> {
    ControlFlow::Continue(())
}

/// Analyses a recording made with `config`: of an excitation, or of a closed loop with a swept reference. The reasons of the
/// verdict mention a run that was not completed. `signals` are those of [`open_with_signals`](crate::open_with_signals), or
/// [`ReadSignals::default`] to read them here.
///
/// # Errors
/// When the recording cannot be read, or contains no frequency response, or `progress` cancels: see [`AnalysisError`].
pub fn analyse(
    recording: &Recording,
    signals: ReadSignals,
    config: &Config,
    progress: &mut AnalysisProgress<'_>,
) -> Result<Analysis, AnalysisError> {
    let signals = run_signals_of(recording, signals, config, progress)?;
    let filled_ticks = signals.filled_ticks();
    let estimate = estimated(recording, signals, config, progress)?;
    let with_modes = ModalStep {
        config,
        certainty: Certainty::ONE_LOOK,
    };
    let analysis = with_modes.of(estimate, filled_ticks, progress)?;
    let verdict = cautions(recording)
        .into_iter()
        .fold(analysis.verdict, |verdict, caution| {
            verdict.with(Some(caution))
        });
    Ok(Analysis {
        verdict,
        ..analysis
    })
}

/// The signals as read with the recording, or else by reading it again.
pub(crate) fn run_signals_of(
    recording: &Recording,
    signals: ReadSignals,
    config: &Config,
    progress: &mut AnalysisProgress<'_>,
) -> Result<RunSignals, AnalysisError> {
    signals.into_result().unwrap_or_else(|| {
        let only_closed = is_closed_loop(recording.metadata());
        read_signals(recording, config.servo.rate_hz, only_closed, progress)
    })
}

/// The frequency response of a recording, from the commanded current to the measured position: [`Analysis::frf`].
pub(super) fn measured_response(
    recording: &Recording,
    signals: ReadSignals,
    config: &Config,
) -> Result<Frf, AnalysisError> {
    let signals = run_signals_of(recording, signals, config, &mut never_cancels)?;
    Ok(estimated(recording, signals, config, &mut never_cancels)?.frf)
}

/// Defects of a run that affect its results.
pub(crate) fn cautions(recording: &Recording) -> Vec<String> {
    let cautions = [Ending::of(recording).caution(), loss_caution(recording)];
    cautions.into_iter().flatten().collect()
}

/// The responses of a recording. Positions in missing ticks are those of the modes that fit the response, in turn with it.
pub(crate) fn estimated(
    recording: &Recording,
    mut signals: RunSignals,
    config: &Config,
    progress: &mut AnalysisProgress<'_>,
) -> Result<ResponseEstimate, AnalysisError> {
    report(progress, AnalysisPhase::Response, 0.0)?;
    let run = ExcitedRun::new(recording, config, signals.missing())?;
    let variance_factor = run.variance_factor()?;
    let rounds = run.predictions();
    for round in 0..rounds {
        let mut as_part = part_of_response(round, rounds, progress);
        let Some(fit) = fit_for_prediction(&run, &signals, config, &mut as_part)? else {
            if round == 0 {
                run.check_positions_on_lines()?;
            }
            break;
        };
        signals.predict_missing(&fit, &SignalPath::from(config));
    }
    Ok(run
        .estimate(&signals)?
        .with_variance_factor(variance_factor))
}

/// Progress of a fit for one of several predictions, as part of that of the response.
fn part_of_response(
    round: usize,
    rounds: usize,
    progress: &mut AnalysisProgress<'_>,
) -> impl FnMut(AnalysisPhase, f64) -> ControlFlow<()> {
    move |_, fraction| {
        let done = (round as f64 + fraction) / rounds as f64;
        progress(AnalysisPhase::Response, done)
    }
}

/// The modes by which missing ticks are predicted; `None` if none can be fitted.
fn fit_for_prediction(
    run: &ExcitedRun<'_>,
    signals: &RunSignals,
    config: &Config,
    progress: &mut AnalysisProgress<'_>,
) -> Result<Option<ModalFit>, AnalysisError> {
    // Positions on straight lines may spoil the margins of a loop.
    let Ok(estimate) = run.estimate(signals) else {
        return Ok(None);
    };
    let fit = fit_modes(&estimate.frf, &MeasurementChain::bench(config), progress)?;
    Ok(fit.ok())
}

/// A warning that records are lost: their ticks were interpolated, or the results lack them.
fn loss_caution(recording: &Recording) -> Option<String> {
    let lost = recording.lost_records();
    (lost > 0).then(|| format!("{lost} records of the run are lost"))
}

/// Reports progress; an error if the receiver cancels.
fn report(
    progress: &mut AnalysisProgress<'_>,
    phase: AnalysisPhase,
    fraction: f64,
) -> Result<(), AnalysisError> {
    match progress(phase, fraction) {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(AnalysisError::Cancelled),
    }
}

/// The step of an analysis after the response: modes, comparison with the model, verdict.
pub(crate) struct ModalStep<'a> {
    /// The configuration of the run.
    pub(crate) config: &'a Config,
    /// How certain signs and sides must be.
    pub(crate) certainty: Certainty,
}

impl ModalStep<'_> {
    /// Fits the modes of a response and compares it with the model.
    pub(crate) fn of(
        &self,
        estimate: ResponseEstimate,
        filled_ticks: u64,
        progress: &mut AnalysisProgress<'_>,
    ) -> Result<Analysis, AnalysisError> {
        let config = self.config;
        let modal = ModalModel::of(&bench_plant::build(&config.plant)?)?;
        let chain = MeasurementChain::bench(config);
        let fit = fit_modes(&estimate.frf, &chain, progress)?;
        let scope = scope_of_model(&modal, self.certainty);
        let verdict = judge(&fit, &estimate.frf.data, &chain, scope)?;
        let model_response = ModelResponse::new(config, &modal);
        let frf = estimate.frf;
        let fitted = fit.as_ref().ok();
        let signs = fitted.map(|fit| SignCheck::of(&fit.modes(), &modal, frf.band_hz()));
        let model = model_response.at(&frf.frequency_hz);
        Ok(Analysis {
            excess_delay: excess_delay(&frf, &model, scope.up_to_rad_s / TAU),
            delay_s: model_response.delay_s(),
            frf,
            model,
            model_response,
            filled_ticks,
            fit,
            signs,
            verdict,
            judged_up_to_rad_s: scope.up_to_rad_s,
            closed: estimate.closed,
            linearity: estimate.linearity,
        })
    }
}

/// The fitted modes, or why none can be fitted. Fails only if the receiver of the progress cancels.
fn fit_modes(
    frf: &Frf,
    chain: &MeasurementChain,
    progress: &mut AnalysisProgress<'_>,
) -> Result<Result<ModalFit, FitError>, AnalysisError> {
    let mut report = |fraction| progress(AnalysisPhase::Modes, fraction);
    match modal::fit_with_progress(&frf.data, chain, &mut report) {
        Err(FitError::Cancelled) => Err(AnalysisError::Cancelled),
        fit => Ok(fit),
    }
}

fn highest_mode_rad_s(modal: &ModalModel) -> f64 {
    let frequencies_rad_s = modal.modes.iter().map(|mode| mode.omega_rad_s);
    frequencies_rad_s.fold(0.0, f64::max)
}

impl Analysis {
    /// Measured time in seconds from a command to the position in the reading: that of the model plus the excess delay.
    pub fn measured_delay_s(&self) -> f64 {
        self.delay_s + self.excess_delay.map_or(0.0, |delay| delay.value)
    }
}

/// The scope of a verdict above the highest mode of a model, whose visible modes must all be found.
pub(crate) fn scope_of_model(modal: &ModalModel, certainty: Certainty) -> VerdictScope {
    let up_to_rad_s = LAST_MODE * highest_mode_rad_s(modal);
    VerdictScope {
        up_to_rad_s,
        expected_modes: Some(visible_modes(modal, up_to_rad_s)),
        certainty,
        duration_s: None,
    }
}

/// Number of modes up to a frequency with a residue.
fn visible_modes(modal: &ModalModel, up_to_rad_s: f64) -> usize {
    let modes = modal.modes.iter().zip(modal.signs());
    let is_visible =
        |(mode, sign): &(&Mode, Sign)| *sign != Sign::Hidden && mode.omega_rad_s <= up_to_rad_s;
    modes.filter(is_visible).count()
}

/// Current and position of a run in open loop at regular times, from its first tick.
///
/// # Errors
/// When the recording cannot be read, or lacks too many ticks.
pub(crate) fn run_signals(recording: &Recording, rate_hz: f64) -> Result<Signals, AnalysisError> {
    let read = read_signals(recording, rate_hz, false, &mut never_cancels)?;
    read.missing()
        .check_ratio(missing_ticks::MAX_RATIO_ON_LINES)?;
    Ok(read.loop_signals.signals)
}

/// Reads every tick of the run, or only those with the loop closed.
fn read_signals(
    recording: &Recording,
    rate_hz: f64,
    only_closed: bool,
    progress: &mut AnalysisProgress<'_>,
) -> Result<RunSignals, AnalysisError> {
    let mut signals = SignalBuilder::new(recording.metadata(), rate_hz);
    let total = recording.tick_count().max(1) as f64;
    for (index, record) in recording.ticks()?.enumerate() {
        let record = record?;
        if is_of_run(&record, only_closed) {
            signals.push(&record)?;
        }
        if index % TICKS_PER_REPORT == 0 {
            report(progress, AnalysisPhase::Reading, index as f64 / total)?;
        }
    }
    signals.finish()
}
