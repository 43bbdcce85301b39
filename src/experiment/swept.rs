//! A swept reference before its run: its amplitudes, where it has none, and what it would do.

use super::plan_error::PlanError;
use crate::config::{Config, ReferenceSettings, validate};
use crate::control::{ClosedLoop, ControllerText, SweptLimits, swept_reference_amplitudes};
use crate::excitation::{Chirp, Excitation, Extremes, reference, within};
use crate::model::plant::LoopPlant;
use crate::rig::simulated;

/// The configuration with amplitudes by the model of the whole rig, and what the run would do by it; as it is, and nothing,
/// of another reference. Refused where an interlock would trip.
pub(super) fn planned(
    mut config: Config,
    controller: &ControllerText,
) -> Result<(Config, Option<Extremes>), PlanError> {
    let ReferenceSettings::Chirp {
        amplitude,
        travel_m,
    } = &config.control.reference
    else {
        return Ok((config, None));
    };
    let modes = simulated::modes(&config)?;
    let closed_loop = ClosedLoop::new(
        LoopPlant::new(&config, &modes),
        modes,
        config.motor.force_constant_n_per_a,
        controller.design(config.servo.rate_hz)?,
    )?;
    let amplitude = match amplitude.is_empty() {
        true => {
            let limits = SweptLimits {
                chirp: &config.chirp,
                travel_m: *travel_m,
                reference_m: config.interlock.soft_limit_m,
            };
            swept_reference_amplitudes(&closed_loop, &limits)
        }
        false => amplitude.clone(),
    };
    config.control.reference = ReferenceSettings::Chirp {
        amplitude,
        travel_m: *travel_m,
    };
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
    let extremes = predicted_extremes(&config, &closed_loop).map_err(unstable)?;
    Ok((config, Some(extremes)))
}

/// The run by the linear model, against every interlock.
fn predicted_extremes(config: &Config, closed_loop: &ClosedLoop) -> Result<Extremes, PlanError> {
    let period_s = config.servo.period_s();
    let reference = reference(&config.control.reference, &config.chirp, None, period_s)?;
    let chirp = Chirp::new(&config.chirp, period_s);
    let course = closed_loop.signals(chirp.ticks() as usize, |tick| reference.at_m(tick as u64));
    let extremes = Extremes::over(course, config);
    let frequency_hz = chirp.frequency_at_hz(extremes.travel_tick);
    within(
        &extremes,
        config,
        frequency_hz,
        "the amplitudes of control.reference and of chirp",
    )?;
    Ok(extremes)
}
