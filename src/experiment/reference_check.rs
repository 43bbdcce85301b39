//! Whether the loop can follow a reference: travel, current and thermal load by the closed-loop model, before motion.
//!
//! A swept reference has its own check in [`swept_reference`](super::swept_reference), which also plans its amplitudes.

use super::plan_error::PlanError;
use super::swept_reference::closed_loop;
use crate::config::Config;
use crate::control::{ClosedLoop, ControllerText};
use crate::excitation::{Extremes, Limits, Reference, ReferenceContext};

/// Largest number of predicted ticks: 400 s at 5 kHz. Beyond it only the interlocks check the current.
const PREDICTED_TICKS: u64 = 2_000_000;

/// Refuses a reference that would trip an interlock by the model of the whole rig; returns its extremes. `file` is the text of the
/// file of the reference. Nothing is predicted for an unstable loop: `control.min_modulus_margin` decides about it.
pub(super) fn predicted(
    config: &Config,
    controller: &ControllerText,
    file: Option<&str>,
) -> Result<Option<Extremes>, PlanError> {
    let context = ReferenceContext {
        chirp: &config.chirp,
        period_s: config.servo.period_s(),
        file,
    };
    let design = config.control.reference.design();
    design.check_file(&context, config.interlock.soft_limit_m)?;
    let closed_loop = closed_loop(config, controller)?;
    if !closed_loop.is_stable() {
        return Ok(None);
    }
    let ticks = context.ticks(config.control.duration_s);
    let reference = design.build(&context)?;
    check_loop(config, &closed_loop, &*reference, ticks, 1.0).map(Some)
}

/// Refuses the reference of `config`, scaled by a factor, in a given loop. The whole reference is predicted, from rest.
pub(super) fn check_tuned(
    config: &Config,
    closed_loop: &ClosedLoop,
    file: Option<&str>,
    reference_factor: f64,
) -> Result<(), PlanError> {
    let context = ReferenceContext {
        chirp: &config.chirp,
        period_s: config.servo.period_s(),
        file,
    };
    let reference = config.control.reference.design().build(&context)?;
    let ticks = context.ticks(config.control.duration_s);
    check_loop(config, closed_loop, &*reference, ticks, reference_factor)?;
    Ok(())
}

/// Refuses a reference with which the loop would trip an interlock within `ticks`; returns the extremes.
fn check_loop(
    config: &Config,
    closed_loop: &ClosedLoop,
    reference: &dyn Reference,
    ticks: u64,
    reference_factor: f64,
) -> Result<Extremes, PlanError> {
    let ticks = ticks.min(PREDICTED_TICKS) as usize;
    let signals = closed_loop.signals(ticks, |tick| reference_factor * reference.at_m(tick as u64));
    let limits = without_slew(config.excitation_limits());
    let extremes = Extremes::over(signals, &limits);
    let setting = "the values of the reference, or its slope";
    limits.check(&extremes, None, setting)?;
    Ok(extremes)
}

/// The amplifier limits the slope of a step, which trips no interlock.
fn without_slew(limits: Limits) -> Limits {
    Limits {
        slew_a_per_s: f64::INFINITY,
        ..limits
    }
}
