//! A stage check as a plan of its own, and its result.

use crate::analysis::run_signals;
use crate::errors::ExperimentError;
use crate::forecast::extremes;
use crate::plan::{Plan, PlanError, closed_loop_of};
use crate::stage_check::{Shot, StageCheck, StageCheckError};
use bench_excitation::StageCheckSignal;
use bench_recording::Recording;

/// The check of the stage before a closed loop.
#[derive(Clone, Debug)]
pub struct PlannedStageCheck {
    /// Its run: open loop, with the interlocks and the calibration of the closed loop.
    pub plan: Plan,
    shot: Shot,
}

impl PlannedStageCheck {
    /// The check before `plan`; `None` if the plan closes no loop or has no certificate.
    ///
    /// # Errors
    /// When the certificate is damaged, allows no check (unless the plan has the reason of an operator), or the model predicts that
    /// the check would trip an interlock.
    pub fn before(plan: &Plan) -> Result<Option<PlannedStageCheck>, ExperimentError> {
        let (Some(controller), Some(text)) = (&plan.controller, &plan.certificate) else {
            return Ok(None);
        };
        let loaded = text.load().map_err(PlanError::from)?;
        let model = closed_loop_of(controller, &plan.config)?;
        let Some(shot) = Shot::of(&loaded, &model, &plan.config) else {
            return match plan.override_reason {
                Some(_) => Ok(None),
                None => Err(StageCheckError::NothingToCompare.into()),
            };
        };
        require_within_limits(&shot, plan)?;
        let plan = plan.stage_check(shot.settings.clone());
        Ok(Some(PlannedStageCheck { plan, shot }))
    }

    /// Compares the recorded run with the certificate.
    ///
    /// # Errors
    /// When the recording cannot be read, or allows no estimate.
    pub fn evaluated(&self, recording: &Recording) -> Result<StageCheck, StageCheckError> {
        let signals = run_signals(recording, self.plan.config.servo.rate_hz);
        let signals = signals.map_err(|error| StageCheckError::Record(error.to_string()))?;
        let check = StageCheck::of(&self.shot, &signals);
        check.ok_or_else(|| StageCheckError::Record("it is too short".into()))
    }
}

fn require_within_limits(shot: &Shot, plan: &Plan) -> Result<(), ExperimentError> {
    let signal = StageCheckSignal::new(&shot.settings, plan.config.servo.period_s());
    let extremes = extremes(&signal, &plan.config)?;
    let limits = plan.config.excitation_limits();
    let setting = "the travel of the stage check, a ratio of interlock.soft_limit_m";
    Ok(limits.check(&extremes, None, setting)?)
}
