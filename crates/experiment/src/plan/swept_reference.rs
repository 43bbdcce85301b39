//! The plan of a swept reference: its amplitudes, unless the user states them, and its extremes by the model.

use super::plan_error::PlanError;
use bench_config::{Config, ReferenceSettings, validate};
use bench_control::{ClosedLoop, ControllerText, SweptLimits, swept_reference_amplitudes};
use bench_excitation::{Extremes, ReferenceContext, SweptReference};
use bench_plant::LoopPlant;
use bench_rig::simulated;

/// The configuration with the amplitudes of a swept reference, and the predicted extremes of the run, both by the model of the
/// whole rig. Another reference has no extremes, and its configuration is returned unchanged. Refuses a run that would trip
/// an interlock.
pub(crate) fn planned(
    mut config: Config,
    controller: &ControllerText,
) -> Result<(Config, Option<Extremes>), PlanError> {
    let ReferenceSettings::Chirp(swept) = &config.control.reference else {
        return Ok((config, None));
    };
    let closed_loop = closed_loop(&config, controller)?;
    let swept = with_amplitudes(swept, &config, &closed_loop);
    config.control.reference = ReferenceSettings::Chirp(swept.clone());
    // Values that are not allowed could not be read back from the recording.
    validate(&config)?;
    match predicted_extremes(&swept, &config, &closed_loop) {
        // A smaller current would not help.
        Err(_) if !closed_loop.margins().stable => Err(PlanError::Unstable),
        extremes => Ok((config, Some(extremes?))),
    }
}

/// The loop with the model of the whole rig.
pub(crate) fn closed_loop(
    config: &Config,
    controller: &ControllerText,
) -> Result<ClosedLoop, PlanError> {
    let modes = simulated::modes(&config.plant, &config.sim)?;
    let plant = LoopPlant::new(config, &modes);
    let force_constant_n_per_a = config.motor.force_constant_n_per_a;
    let design = controller.design(config.servo.rate_hz)?;
    let closed_loop = ClosedLoop::new(plant, modes, force_constant_n_per_a, design)?;
    Ok(closed_loop)
}

/// The reference with its own amplitudes or, if it has none, with those by the model.
fn with_amplitudes(
    swept: &SweptReference,
    config: &Config,
    closed_loop: &ClosedLoop,
) -> SweptReference {
    if !swept.amplitude.is_empty() {
        return swept.clone();
    }
    let limits = SweptLimits {
        chirp: &config.chirp,
        travel_m: swept.travel_m,
        reference_m: config.interlock.soft_limit_m,
    };
    SweptReference {
        amplitude: swept_reference_amplitudes(closed_loop, &limits),
        travel_m: swept.travel_m,
    }
}

/// The extremes of the run by the linear model, checked against every interlock.
fn predicted_extremes(
    reference: &SweptReference,
    config: &Config,
    closed_loop: &ClosedLoop,
) -> Result<Extremes, PlanError> {
    let sweep = reference.sweep(&ReferenceContext {
        chirp: &config.chirp,
        period_s: config.servo.period_s(),
        file: None,
    });
    let signals = closed_loop.signals(sweep.ticks() as usize, |tick| sweep.at(tick as u64));
    let limits = config.excitation_limits();
    let extremes = Extremes::over(signals, &limits);
    let frequency_hz = sweep.frequency_at_hz(extremes.travel_tick);
    let setting = "the amplitudes of control.reference and of chirp";
    limits.check(&extremes, Some(frequency_hz), setting)?;
    Ok(extremes)
}
