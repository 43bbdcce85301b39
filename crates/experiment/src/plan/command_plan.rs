//! The planned command of a closed loop: shaping, prefilter and feedforward as the filters that the recording stores.

use serde::Serialize;

use super::loop_check::closed_loop_of;
use super::plan_error::PlanError;
use super::step_plan;
use bench_config::{
    Config, FeedforwardSettings, MinimumTimeSettings, PrefilterSettings, ShaperSettings,
    VibrationSettings,
};
use bench_control::{ClosedLoop, ControllerText, inverse_filter};
use bench_excitation::command::{CommandFilter, ImpulseShaper, Taps, Vibration, low_pass_taps};

/// A mode that answers a step with less than this ratio of its height is not shaped.
const LEAST_STEP_RATIO: f64 = 0.01;
/// Largest number of modes that are shaped without a setting.
const MOST_MODES: usize = 3;

/// A planned command: its filters and their figures.
#[derive(Clone, Debug, PartialEq)]
pub struct CommandPlan {
    /// The filters.
    pub filter: CommandFilter,
    /// Figures for the user; `None` for a plan that was read from a recording.
    pub summary: Option<CommandSummary>,
}

impl From<CommandFilter> for CommandPlan {
    fn from(filter: CommandFilter) -> CommandPlan {
        CommandPlan {
            filter,
            summary: None,
        }
    }
}

/// Figures of a planned command.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CommandSummary {
    /// Kind of the shaper, as in `control.shaper.kind`.
    pub shaper: &'static str,
    /// The modes of an impulse shaper.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub modes: Vec<ShapedMode>,
    /// Planned time in seconds from the step to 2 %, of a minimum-time step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settling_time_s: Option<f64>,
    /// Largest planned current in amperes, of a minimum-time step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub current_a: Option<f64>,
    /// Largest planned overshoot in per cent of the step, of a minimum-time step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overshoot_percent: Option<f64>,
    /// Number of plants of a minimum-time step.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plants: Option<usize>,
    /// Whether there is a prefilter.
    pub prefilter: bool,
    /// Whether there is a feedforward current.
    pub feedforward: bool,
    /// How far ahead the filters read the reference, in seconds.
    pub preview_s: f64,
    /// Their longest delay in seconds.
    pub delay_s: f64,
}

/// A mode of an impulse shaper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ShapedMode {
    /// Natural frequency in rad/s.
    pub omega_rad_s: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

/// Plans the command of `config`; `None` if it has none beside its reference.
///
/// # Errors
/// When the loop is unstable by the model, when the step cannot be planned within the limits, or when a filter would be too long.
pub(super) fn planned(
    config: &Config,
    controller: &ControllerText,
) -> Result<Option<CommandPlan>, PlanError> {
    if !config.control.has_command() {
        return Ok(None);
    }
    let closed_loop = closed_loop_of(controller, config)?;
    if !closed_loop.is_stable() {
        return Err(PlanError::UnstableCommand);
    }
    let mut summary = CommandSummary {
        shaper: config.control.shaper.name(),
        ..CommandSummary::default()
    };
    let shaper = shaper_taps(config, controller, &closed_loop, &mut summary)?;
    let prefilter = prefilter_taps(config, &mut summary);
    let reference = shaper.in_series_with(&prefilter);
    let filter = with_feedforward(config, &closed_loop, &reference, &mut summary)?;
    let (first, last) = filter.span_ticks();
    let period_s = config.servo.period_s();
    summary.preview_s = first.unsigned_abs() as f64 * period_s;
    summary.delay_s = last as f64 * period_s;
    Ok(Some(CommandPlan {
        filter,
        summary: Some(summary),
    }))
}

fn shaper_taps(
    config: &Config,
    controller: &ControllerText,
    closed_loop: &ClosedLoop,
    summary: &mut CommandSummary,
) -> Result<Taps, PlanError> {
    let (shaper, modes) = match &config.control.shaper {
        ShaperSettings::None => return Ok(Taps::identity()),
        ShaperSettings::MinimumTime(settings) => {
            return minimum_time_taps(config, controller, settings, summary);
        }
        ShaperSettings::Zv(settings) => (ImpulseShaper::Zv, &settings.modes),
        ShaperSettings::Zvd(settings) => (ImpulseShaper::Zvd, &settings.modes),
        ShaperSettings::Ei(settings) => {
            (ImpulseShaper::Ei(settings.vibration_ratio), &settings.modes)
        }
    };
    let modes = vibrations(modes, closed_loop);
    if modes.is_empty() {
        return Err(PlanError::NoVibration);
    }
    summary.modes = modes.iter().map(ShapedMode::from).collect();
    Ok(shaper.taps(&modes, config.servo.period_s()))
}

impl From<&Vibration> for ShapedMode {
    fn from(mode: &Vibration) -> ShapedMode {
        ShapedMode {
            omega_rad_s: mode.omega_rad_s,
            damping_ratio: mode.damping_ratio,
        }
    }
}

/// The configured modes; without any, those of the closed loop that a step excites most.
fn vibrations(settings: &[VibrationSettings], closed_loop: &ClosedLoop) -> Vec<Vibration> {
    if !settings.is_empty() {
        return settings.iter().map(Vibration::from).collect();
    }
    let modes = closed_loop.step_modes(LEAST_STEP_RATIO);
    let strongest = modes.iter().take(MOST_MODES);
    let vibrations = strongest.map(|mode| Vibration {
        omega_rad_s: mode.omega_rad_s,
        damping_ratio: mode.damping_ratio,
    });
    vibrations.collect()
}

fn minimum_time_taps(
    config: &Config,
    controller: &ControllerText,
    settings: &MinimumTimeSettings,
    summary: &mut CommandSummary,
) -> Result<Taps, PlanError> {
    let step = config.control.reference.design().step();
    let height_m = step.map_or(0.0, |step| step.height_m.abs());
    if height_m == 0.0 {
        return Ok(Taps::identity());
    }
    let planned = step_plan::planned(config, controller, settings, height_m)?;
    summary.settling_time_s = Some(planned.step.settling_ticks as f64 * config.servo.period_s());
    summary.current_a = Some(planned.step.current_a);
    summary.overshoot_percent = Some(100.0 * planned.step.overshoot_m / height_m);
    summary.plants = Some(planned.plants);
    Ok(planned.step.taps)
}

fn prefilter_taps(config: &Config, summary: &mut CommandSummary) -> Taps {
    match &config.control.prefilter {
        PrefilterSettings::None => Taps::identity(),
        PrefilterSettings::LowPass(settings) => {
            summary.prefilter = true;
            low_pass_taps(settings.frequency_hz, config.servo.period_s())
        }
    }
}

fn with_feedforward(
    config: &Config,
    closed_loop: &ClosedLoop,
    reference: &Taps,
    summary: &mut CommandSummary,
) -> Result<CommandFilter, PlanError> {
    let FeedforwardSettings::Inverse(settings) = &config.control.feedforward else {
        return Ok(CommandFilter::new(reference.clone(), Taps::default())?);
    };
    summary.feedforward = true;
    let inverse = inverse_filter(closed_loop.plant(), settings.bandwidth_hz)?;
    // Refuses a filter that is too long before it is convolved.
    let inverse = CommandFilter::new(inverse.reference, inverse.feedforward)?;
    Ok(CommandFilter::new(
        reference.in_series_with(inverse.reference()),
        reference.in_series_with(inverse.feedforward()),
    )?)
}
