//! The two runs of a calibration.

use std::time::SystemTime;

use super::staircase_fit::{StaircaseFit, fit};
use crate::analysis::{Analysis, ReadSignals, analyse, never_cancels};
use crate::errors::ExperimentError;
use crate::forecast::{extremes, predicted_extremes};
use crate::live::abandon_on_signal;
use crate::plan::Plan;
use crate::run::{RunSummary, Runner, close};
use bench_base::timestamp;
use bench_config::{Config, ExcitationKind};
use bench_excitation::{Extremes, Staircase};
use bench_plant::{ModalModel, PlantError};
use bench_recording::Recording;
use bench_rig::calibration::{
    AmplifierCalibration, Calibration, ChainCalibration, ProbeCalibration,
};

/// A calibration and its runs.
#[derive(Clone, Debug)]
pub struct CalibrationRun {
    /// The run of the static steps.
    pub steps: RunSummary,
    /// Recording of the chirp for the delay.
    pub delay_recording: Option<String>,
    /// The calibration, or why there is none.
    pub calibration: Result<Calibration, String>,
}

/// The settings of a calibration: without a calibration in use, and with one shortened chirp for the delay.
pub fn settings(mut config: Config) -> Config {
    config.calibration.file = None;
    config.excitation.kind = ExcitationKind::Chirp;
    let (chirp, duration_s) = (&mut config.chirp, config.calibrate.chirp_duration_s);
    let ratio = duration_s / chirp.duration_s;
    chirp.repetitions = 1;
    chirp.duration_s = duration_s;
    chirp.fade_in_s *= ratio;
    chirp.fade_out_s *= ratio;
    config
}

/// The predicted extremes of the runs of a calibration, by the model of the whole rig.
#[derive(Clone, Copy, Debug)]
pub struct CalibrationPlan {
    /// Extremes of the static steps.
    pub steps: Extremes,
    /// Extremes of the chirp for the delay.
    pub chirp: Extremes,
}

/// Predicts the runs of a calibration. Refuses steps, or a chirp, that would trip an interlock.
pub fn check(config: &Config) -> Result<CalibrationPlan, ExperimentError> {
    compliance_m_per_a(config)?;
    let steps = check_steps(config)?;
    let chirp = predicted_extremes(config)?;
    Ok(CalibrationPlan { steps, chirp })
}

fn check_steps(config: &Config) -> Result<Extremes, ExperimentError> {
    let steps = Staircase::new(&config.calibrate.steps(), config.servo.period_s());
    let extremes = extremes(&steps, config)?;
    let amplitude_a = config.calibrate.amplitude_a;
    let limit_a = (config.amplifier.current_limit_a).min(config.motor.peak_current_a());
    let soft_limit_m = config.interlock.soft_limit_m;
    let continuous_a = config.motor.continuous_current_a();
    let limit = "the limit of amplifier and motor";
    require(amplitude_a, limit_a, "A", limit)?;
    require(extremes.travel_m, soft_limit_m, "m", "the soft limit")?;
    let limit = "the continuous current";
    require(extremes.thermal_current_a, continuous_a, "A", limit)?;
    Ok(extremes)
}

fn require(value: f64, limit: f64, unit: &str, what: &str) -> Result<(), ExperimentError> {
    if value > limit {
        return Err(ExperimentError::Refused(format!(
            "the steps would reach {value:.3e} {unit}, above {what} of {limit:.3e} {unit}; lower calibrate.amplitude_a"
        )));
    }
    Ok(())
}

/// Makes a calibration: runs the static steps, fits them, and measures the delay with a chirp if `with_delay`.
pub fn run(
    runner: &Runner,
    config: &Config,
    with_delay: bool,
) -> Result<CalibrationRun, ExperimentError> {
    let (steps, calibration) = static_steps(runner, config)?;
    let mut result = CalibrationRun {
        steps,
        delay_recording: None,
        calibration,
    };
    if let (Ok(calibration), true) = (&mut result.calibration, with_delay) {
        result.delay_recording = Some(measure_delay(runner, config, calibration)?);
    }
    Ok(result)
}

fn static_steps(
    runner: &Runner,
    config: &Config,
) -> Result<(RunSummary, Result<Calibration, String>), ExperimentError> {
    let mut run = runner.run(&Plan::calibrate(config.clone()), "static steps")?;
    let summary = RunSummary::of(&mut run)?;
    let recording = Recording::open(&run.path)?;
    let calibration = match fitted(&summary, &recording, config) {
        Ok(fit) => checked(calibration(config, &fit, &recording)?, config),
        Err(why) => Err(why),
    };
    close(run, &summary)?;
    Ok((summary, calibration))
}

/// The fit of recorded static steps beside the model.
#[derive(Clone, Copy, Debug)]
pub struct StaircaseResult {
    /// The fit.
    pub fit: StaircaseFit,
    /// Static compliance of the model, from current to displacement, in metres per ampere.
    pub model_m_per_a: f64,
}

/// Fits the static steps in a recording.
///
/// # Errors
/// With the reason why they give no calibration.
pub fn staircase(recording: &Recording, config: &Config) -> Result<StaircaseResult, String> {
    let fit = fit(recording, &config.calibrate, config.servo.period_s());
    Ok(StaircaseResult {
        fit: fit.map_err(|error| error.to_string())?,
        model_m_per_a: compliance_m_per_a(config).map_err(|error| error.to_string())?,
    })
}

/// The measured calibration, if a run may use it.
fn checked(calibration: Calibration, config: &Config) -> Result<Calibration, String> {
    let (settings, current_error_a) = (&config.calibration, config.interlock.current_error_a);
    match calibration.check(settings, current_error_a) {
        Ok(()) => Ok(calibration),
        Err(defect) => Err(defect.to_string()),
    }
}

fn fitted(
    summary: &RunSummary,
    recording: &Recording,
    config: &Config,
) -> Result<StaircaseFit, String> {
    if !summary.is_completed() {
        let outcome = summary.outcome.name();
        return Err(format!("the run of the static steps {outcome}"));
    }
    fit(recording, &config.calibrate, config.servo.period_s()).map_err(|error| error.to_string())
}

fn calibration(
    config: &Config,
    fit: &StaircaseFit,
    recording: &Recording,
) -> Result<Calibration, ExperimentError> {
    let model_m_per_a = compliance_m_per_a(config)?;
    let gain = fit.probe_gain(config.calibrate.scale_by, model_m_per_a);
    let device = |key: &str| recording.metadata().get(key).cloned().unwrap_or_default();
    Ok(Calibration {
        made: timestamp::seconds(SystemTime::now()),
        recording: recording.path().display().to_string(),
        amplifier: amplifier_calibration(fit, device("amplifier")),
        probe: ProbeCalibration {
            device: device("probe"),
            gain,
            offset_m: -gain * fit.rest_m,
            noise_rms_m: fit.noise_rms_m,
        },
        chain: chain_calibration(fit, model_m_per_a),
    })
}

fn amplifier_calibration(fit: &StaircaseFit, device: String) -> AmplifierCalibration {
    let (current_gain, current_offset_a) = fit.current.unwrap_or((1.0, 0.0));
    AmplifierCalibration {
        device,
        current_gain,
        current_offset_a,
        measures_current: fit.current.is_some(),
    }
}

/// The chain, without the delay.
fn chain_calibration(fit: &StaircaseFit, model_m_per_a: f64) -> ChainCalibration {
    ChainCalibration {
        compliance_m_per_a: fit.compliance_m_per_a,
        compliance_sigma_m_per_a: fit.compliance_sigma_m_per_a,
        model_m_per_a,
        nonlinearity_ratio: fit.nonlinearity_ratio,
        hysteresis_ratio: fit.hysteresis_ratio,
        delay_s: None,
        delay_sigma_s: None,
    }
}

/// Measures the delay with a chirp and returns its recording. `calibration` is in use, so that the chain has its correct sign.
fn measure_delay(
    runner: &Runner,
    config: &Config,
    calibration: &mut Calibration,
) -> Result<String, ExperimentError> {
    let plan = Plan::chirp(config.clone());
    let used = Some(calibration.clone());
    let mut run = runner.run_calibrated(&plan, "chirp for the delay", used)?;
    let summary = RunSummary::of(&mut run)?;
    if summary.is_completed() {
        let (path, config) = (run.path.clone(), config.clone());
        let analysis = abandon_on_signal(move || -> Result<Analysis, ExperimentError> {
            Ok(analyse(
                &Recording::open(&path)?,
                ReadSignals::default(),
                &config,
                &mut never_cancels,
            )?)
        })?;
        set_delay(&mut calibration.chain, analysis.transpose()?);
    }
    close(run, &summary)?;
    Ok(summary.recording)
}

fn set_delay(chain: &mut ChainCalibration, analysis: Option<Analysis>) {
    let delay = analysis.and_then(|analysis| Some((analysis.delay_s, analysis.excess_delay?)));
    chain.delay_s = delay.map(|(delay_s, excess)| delay_s + excess.value);
    chain.delay_sigma_s = delay.map(|(_, excess)| excess.sigma);
}

/// The static compliance of the model, from current to displacement.
fn compliance_m_per_a(config: &Config) -> Result<f64, ExperimentError> {
    let modes = ModalModel::of(&bench_plant::build(&config.plant)?)?.modes;
    if modes.iter().any(|mode| mode.omega_rad_s == 0.0) {
        let what = "a static compliance, which `bench calibrate` measures,";
        return Err(PlantError::FreeBody(what).into());
    }
    let compliances = modes
        .iter()
        .map(|mode| mode.residue_per_kg() / (mode.omega_rad_s * mode.omega_rad_s));
    Ok(compliances.sum::<f64>() * config.motor.force_constant_n_per_a)
}
