//! The plan of a swept reference: its amplitudes, where the user gives none, and its extremes by the model.

use super::plan_error::PlanError;
use crate::config::{Config, ReferenceSettings, validate};
use crate::control::{ClosedLoop, ControllerText, SweptLimits, swept_reference_amplitudes};
use crate::excitation::{Extremes, ReferenceContext, SweptReference};
use crate::model::plant::LoopPlant;
use crate::rig::simulated;

/// The configuration with amplitudes by the model of the whole rig, and what the run would do by it; as it is, and nothing,
/// of another reference. Refused where an interlock would trip.
pub(super) fn planned(
    mut config: Config,
    controller: &ControllerText,
) -> Result<(Config, Option<Extremes>), PlanError> {
    let ReferenceSettings::Chirp(swept) = &config.control.reference else {
        return Ok((config, None));
    };
    let modes = simulated::modes(&config)?;
    let closed_loop = ClosedLoop::new(
        LoopPlant::new(&config, &modes),
        modes,
        config.motor.force_constant_n_per_a,
        controller.design(config.servo.rate_hz)?,
    )?;
    let travel_m = swept.travel_m;
    let amplitude = match swept.amplitude.is_empty() {
        true => {
            let limits = SweptLimits {
                chirp: &config.chirp,
                travel_m,
                reference_m: config.interlock.soft_limit_m,
            };
            swept_reference_amplitudes(&closed_loop, &limits)
        }
        false => swept.amplitude.clone(),
    };
    config.control.reference = ReferenceSettings::Chirp(SweptReference {
        amplitude,
        travel_m,
    });
    // What is not allowed now could not be read back from the recording.
    validate(&config)?;
    // What a loop that runs away would do has no largest current to lower.
    let unstable = |error| {
        if closed_loop.margins().stable {
            error
        } else {
            PlanError::Unstable
        }
    };
    let extremes = match &config.control.reference {
        ReferenceSettings::Chirp(swept) => predicted_extremes(swept, &config, &closed_loop),
        _ => return Ok((config, None)),
    };
    let extremes = extremes.map_err(unstable)?;
    Ok((config, Some(extremes)))
}

/// The run by the linear model, against every interlock.
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
