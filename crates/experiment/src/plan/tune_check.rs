//! Whether a run in progress may be changed: the margins of the new loop gain, and what the new reference does to the rig by the
//! model. It is checked before the request is sent to the loop.

use super::loop_check::{MarginError, Stage, closed_loop_of, require_margins};
use super::plan_error::PlanError;
use super::reference_check;
use super::run_plan::Plan;
use super::swept_reference::closed_loop;
use bench_control::{ClosedLoop, ControllerText, TunedDesign};
use bench_rt::tuning::Factors;

/// A change that is refused. The run goes on as it was.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TuneRefusal {
    /// The run has no control loop.
    #[error("the run has no control loop; only runs of `bench control` can be tuned")]
    NoLoop,
    /// The margins of the new gain.
    #[error(transparent)]
    Margin(#[from] MarginError),
    /// The new reference or gain would trip an interlock by the model.
    #[error(transparent)]
    Plan(#[from] PlanError),
}

/// Refuses factors with which the loop has too small a margin, or with which the reference of `plan` would trip an interlock by the
/// model. The whole reference is predicted, from rest: the ramp from the present factors adds no more than the model predicts
/// for a reference that begins.
pub fn check_tune(plan: &Plan, factors: Factors, stage: Stage) -> Result<(), TuneRefusal> {
    let controller = plan.controller.as_ref().ok_or(TuneRefusal::NoLoop)?;
    let model = closed_loop_of(controller, &plan.config)?;
    let margins = tuned(model, plan, controller, factors)?.margins();
    require_margins(&plan.config, &margins, stage)?;
    let rig = tuned(
        closed_loop(&plan.config, controller)?,
        plan,
        controller,
        factors,
    )?;
    if rig.is_stable() {
        reference_check::check_tuned(&plan.planned_reference(), &rig, factors.reference)?;
    }
    Ok(())
}

/// The loop with another gain.
fn tuned(
    nominal: ClosedLoop,
    plan: &Plan,
    controller: &ControllerText,
    factors: Factors,
) -> Result<ClosedLoop, PlanError> {
    let design = TunedDesign {
        design: controller.design(plan.config.servo.rate_hz)?,
        gain: factors.gain,
    };
    Ok(nominal.with_design(Box::new(design))?)
}
