//! Whether the loop can follow a reference: travel, current and thermal load by the closed-loop model, before motion.
//!
//! A swept reference has its own check in [`swept_reference`](super::swept_reference), which also plans its amplitudes.

use super::plan_error::PlanError;
use super::swept_reference::closed_loop;
use bench_config::Config;
use bench_control::{ClosedLoop, ControllerText};
use bench_excitation::command::{CommandFilter, CommandSource, FilteredCommand, Unfiltered};
use bench_excitation::{Extremes, Limits, ReferenceContext};

/// Largest number of predicted ticks: 400 s at 5 kHz. Beyond it only the interlocks check the current.
const PREDICTED_TICKS: u64 = 2_000_000;

/// A reference with what its command needs.
#[derive(Clone, Copy, Debug)]
pub(super) struct PlannedReference<'a> {
    /// The settings.
    pub config: &'a Config,
    /// Text of the file of the reference, if it has one.
    pub file: Option<&'a str>,
    /// The filters of the command, if it is not the reference alone.
    pub filter: Option<&'a CommandFilter>,
}

impl<'a> PlannedReference<'a> {
    /// What the settings of the reference need.
    pub(super) fn context(&self) -> ReferenceContext<'a> {
        ReferenceContext {
            chirp: &self.config.chirp,
            period_s: self.config.servo.period_s(),
            file: self.file,
        }
    }

    /// The command of the loop.
    pub(super) fn command(&self) -> Result<Box<dyn CommandSource>, PlanError> {
        let design = self.config.control.reference.design();
        let reference = design.build(&self.context())?;
        Ok(match self.filter {
            None => Box::new(Unfiltered(reference)),
            Some(filter) => Box::new(FilteredCommand::new(reference, filter.clone())),
        })
    }

    /// What reduces current and travel.
    fn to_lower(self) -> &'static str {
        if self.config.control.feedforward.is_none() {
            "the values of the reference, or its slope"
        } else {
            "the values of the reference, its slope, or control.feedforward.bandwidth_hz"
        }
    }
}

/// Refuses a reference that would trip an interlock by the model of the whole rig; returns its extremes. Nothing is predicted for an
/// unstable loop: `control.min_modulus_margin` decides about it.
pub(super) fn predicted(
    reference: &PlannedReference<'_>,
    controller: &ControllerText,
) -> Result<Option<Extremes>, PlanError> {
    let config = reference.config;
    let design = config.control.reference.design();
    design.check_file(&reference.context(), config.interlock.soft_limit_m)?;
    let closed_loop = closed_loop(config, controller)?;
    if !closed_loop.is_stable() {
        return Ok(None);
    }
    check_tuned(reference, &closed_loop, 1.0).map(Some)
}

/// Refuses a reference, scaled by a factor, with which a given loop would trip an interlock; returns the extremes. The whole reference
/// is predicted, from rest, with its feedforward current.
pub(super) fn check_tuned(
    reference: &PlannedReference<'_>,
    closed_loop: &ClosedLoop,
    reference_factor: f64,
) -> Result<Extremes, PlanError> {
    let config = reference.config;
    let mut command = reference.command()?;
    let ticks = reference.context().ticks(config.control.duration_s);
    let ticks = ticks.min(PREDICTED_TICKS) as usize;
    let signals = closed_loop.commanded_signals(ticks, |tick| {
        command.at(tick as u64).scaled(reference_factor)
    });
    let limits = without_slew(config.excitation_limits());
    let extremes = Extremes::over(signals, &limits);
    limits.check(&extremes, None, reference.to_lower())?;
    Ok(extremes)
}

/// The amplifier limits the slope of a step, which trips no interlock.
fn without_slew(limits: Limits) -> Limits {
    Limits {
        slew_a_per_s: f64::INFINITY,
        ..limits
    }
}
