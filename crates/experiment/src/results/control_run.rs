//! A recorded closed-loop run as its report shows it.

use super::closed_signals::ClosedSignals;
use super::error_spectrum::{ErrorSpectrum, SpectrumModel, error_spectrum};
use super::overview::{Overview, overview};
use super::run_figures::{RunFigures, run_figures};
use super::sine_response::SineResponse;
use super::step_response::{StepResponse, step_response};
use super::tracking::{TrackingMetrics, steady_tick, tracking_metrics};
use crate::analysis::Ending;
use crate::errors::ExperimentError;
use crate::forecast::PredictedSine;
use crate::plan::{Plan, PlanError, closed_loop_of, swept_reference};
use crate::run::TripSummary;
use bench_base::units::{hz, rad_s};
use bench_config::Config;
use bench_control::{ClosedLoop, ControllerText, Margins};
use bench_recording::Recording;
use bench_rig::devices::SIMULATED;
use bench_rig::simulated::DisturbanceSpectra;
use nalgebra::Complex;

/// Lowest drawn frequency of the loop as a part of its lowest mode or of its crossover.
const LOWEST_RATIO: f64 = 0.03;

/// Everything that the report of a closed-loop run shows.
#[derive(Clone, Debug)]
pub struct ControlRun {
    /// How it ended.
    pub ending: Ending,
    /// The trip that ended it.
    pub trip: Option<TripSummary>,
    /// Time with zero current before the loop closed, in seconds.
    pub closed_at_s: f64,
    /// Measured settling, overshoot and steady state; `None` if the run ended before it.
    pub tracking: Option<TrackingMetrics>,
    /// Largest values and heat of the whole run.
    pub figures: RunFigures,
    /// The step, if the reference is one.
    pub step: Option<StepResponse>,
    /// Response of the model at the frequency of a sine.
    pub predicted_sine: Option<PredictedSine>,
    /// The signals of the whole run.
    pub overview: Overview,
    /// Spectrum of the steady-state error; `None` after a trip, or of a steady state that is too short.
    pub spectrum: Option<ErrorSpectrum>,
    /// The loop by the model.
    pub model: LoopModel,
}

/// A loop by the model of the configuration.
#[derive(Clone, Debug)]
pub struct LoopModel {
    /// Frequencies in hertz, rising.
    pub frequency_hz: Vec<f64>,
    /// L = P C at these frequencies.
    pub loop_gain: Vec<Complex<f64>>,
    /// Its margins.
    pub margins: Margins,
    /// Least modulus margin with which it may run; 0 for none.
    pub min_modulus_margin: f64,
}

impl ControlRun {
    /// The step, if the run has reached it.
    pub fn measured_step(&self) -> Option<&StepResponse> {
        let step = self.step.as_ref();
        step.filter(|step| !step.positions_m.is_empty())
    }

    /// The measured response to a sine.
    pub fn sine(&self) -> Option<SineResponse> {
        self.tracking?.sine
    }
}

/// The report of a recorded closed-loop run.
///
/// # Errors
/// When the recording cannot be read or has no controller, or the loop cannot be computed.
pub fn control_run(recording: &Recording, plan: &Plan) -> Result<ControlRun, ExperimentError> {
    let config = &plan.config;
    let controller = plan.controller.as_ref();
    let controller = controller.ok_or(PlanError::Missing("controller"))?;
    let closed_loop = closed_loop_of(controller, config)?;
    let ending = Ending::of(recording);
    let model = LoopModel::of(&closed_loop, config);
    Ok(ControlRun {
        trip: TripSummary::of(ending),
        closed_at_s: config.control.settle_s,
        tracking: tracking_metrics(recording, &config.control, &config.servo)?,
        figures: run_figures(recording, config, plan.motor.thermal_a2)?,
        step: step_response(recording, plan)?,
        predicted_sine: PredictedSine::of(config, &closed_loop, &model.margins),
        overview: overview(recording)?,
        spectrum: spectrum(recording, config, controller, ending)?,
        model,
        ending,
    })
}

impl LoopModel {
    /// The sampled loop, with hold, delay and amplifier.
    pub fn of(closed_loop: &ClosedLoop, config: &Config) -> LoopModel {
        let margins = closed_loop.margins();
        let response = |w: f64| closed_loop.sampled_loop(w);
        LoopModel::new(closed_loop, config, margins, response)
    }

    /// The loop in continuous time, without delay and amplifier, with its margins. A controller without a continuous response gives no numbers.
    pub fn continuous(closed_loop: &ClosedLoop, config: &Config, margins: Margins) -> LoopModel {
        let unknown = Complex::from(f64::NAN);
        let response = |w: f64| closed_loop.continuous_loop(w).unwrap_or(unknown);
        LoopModel::new(closed_loop, config, margins, response)
    }

    fn new(
        closed_loop: &ClosedLoop,
        config: &Config,
        margins: Margins,
        response: impl Fn(f64) -> Complex<f64>,
    ) -> LoopModel {
        let nyquist_rad_s = std::f64::consts::PI * config.servo.rate_hz;
        let lowest_rad_s = lowest_rad_s(closed_loop, &margins);
        let frequencies = closed_loop.frequencies(lowest_rad_s, nyquist_rad_s);
        let mut frequency_hz: Vec<f64> = frequencies.into_iter().map(hz).collect();
        // Two neighbours can be equal after the division by 2 pi.
        frequency_hz.dedup();
        let frequencies = frequency_hz.iter();
        LoopModel {
            loop_gain: frequencies
                .map(|frequency_hz| response(rad_s(*frequency_hz)))
                .collect(),
            frequency_hz,
            margins,
            min_modulus_margin: config.control.min_modulus_margin,
        }
    }
}

/// The lowest frequency that a plot of the loop needs.
fn lowest_rad_s(closed_loop: &ClosedLoop, margins: &Margins) -> f64 {
    let modes = closed_loop.modes().iter().map(|mode| mode.omega_rad_s);
    let modes = modes.filter(|omega_rad_s| *omega_rad_s > 0.0);
    let lowest = modes
        .chain(margins.crossover_rad_s)
        .fold(f64::INFINITY, f64::min);
    if lowest.is_finite() {
        LOWEST_RATIO * lowest
    } else {
        1.0
    }
}

/// The spectrum of the error, beside that by the model if the stage was simulated. An unstable loop has none.
fn spectrum(
    recording: &Recording,
    config: &Config,
    controller: &ControllerText,
    ending: Ending,
) -> Result<Option<ErrorSpectrum>, ExperimentError> {
    if ending.trip().is_some() {
        return Ok(None);
    }
    let rig = rig_loop(recording, config, controller)?;
    let model = match &rig {
        Some(closed_loop) => Some(SpectrumModel {
            closed_loop,
            disturbance: DisturbanceSpectra::of(config)?,
        }),
        None => None,
    };
    let signals = ClosedSignals::of(recording)?;
    let steady = steady_tick(&config.control, config.servo.rate_hz) as usize;
    let rate_hz = config.servo.rate_hz;
    Ok(error_spectrum(&signals, steady, rate_hz, model.as_ref()))
}

/// The loop of the whole rig, of a run on the simulated stage whose loop is stable.
fn rig_loop(
    recording: &Recording,
    config: &Config,
    controller: &ControllerText,
) -> Result<Option<ClosedLoop>, ExperimentError> {
    if !was_simulated(recording) {
        return Ok(None);
    }
    let closed_loop = swept_reference::closed_loop(config, controller)?;
    Ok(Some(closed_loop).filter(ClosedLoop::is_stable))
}

fn was_simulated(recording: &Recording) -> bool {
    let device = |name| recording.metadata().get(name).map(String::as_str);
    device("amplifier") == Some(SIMULATED) && device("probe") == Some(SIMULATED)
}
