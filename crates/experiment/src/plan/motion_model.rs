//! The residual monitor of a plan: the models of plant and closed loop that the interlocks compare with the measured motion.

use super::loop_check::closed_loop_of;
use super::plan_error::PlanError;
use super::run_plan::{Plan, RunKind};
use bench_control::ControllerText;
use bench_plant::{LoopPlant, ModalModel};
use bench_rt::residual::{LoopPrediction, ResidualBound, Residuals};

/// The monitor of a run, by the model of the configuration; `None` if the settings switch it off, and for the static steps of a
/// calibration.
pub fn residuals(plan: &Plan) -> Result<Option<Residuals>, PlanError> {
    let settings = &plan.config.interlock;
    let Some(ratio) = settings.model_error_ratio else {
        return Ok(None);
    };
    // The static steps measure scale and sign, which the monitor would take as given.
    if settings.model_error_off.is_some() || plan.kind == RunKind::Calibrate {
        return Ok(None);
    }
    let modes = ModalModel::of(&bench_plant::build(&plan.config.plant)?)?.modes;
    let model = LoopPlant::with_mean_age(&plan.config, &modes);
    let bound = ResidualBound {
        absolute_m: ratio * settings.soft_limit_m,
        share: settings.share_of_model_error(),
    };
    let residuals = Residuals::new(model, &modes, bound);
    Ok(Some(match &plan.controller {
        Some(controller) => residuals.closed_by(prediction(plan, controller)?),
        None => residuals,
    }))
}

/// The prediction of a closed loop: by its model if the model is linear and stable.
fn prediction(plan: &Plan, controller: &ControllerText) -> Result<LoopPrediction, PlanError> {
    let servo = &plan.config.servo;
    let model = closed_loop_of(controller, &plan.config);
    Ok(match model.map(|model| model.is_stable()) {
        Ok(true) => LoopPrediction::Model(controller.design(servo.rate_hz)?.law(servo.period_s())),
        Ok(false) => LoopPrediction::Unstable,
        Err(_) => LoopPrediction::NotLinear,
    })
}
