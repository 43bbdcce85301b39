//! What a run will do, before a rig is open: settings, program, references and texts.
//!
//! First a plan is described (`description`) and its command planned (`swept_reference`, `step_plan`, `command_plan`); then loop and
//! reference are checked by the model (`loop_check`, `reference_check`); `run_plan` holds the result. `motion_model` and `tune_check`
//! use a complete plan: the residual monitor, and changes of a run in progress.

mod command_plan;
mod description;
mod loop_check;
mod motion_model;
mod motor_start;
mod plan_error;
mod reference_check;
mod run_plan;
mod step_plan;
pub(crate) mod swept_reference;
mod tune_check;

pub use command_plan::{CommandSummary, ShapedMode};
pub use description::{
    Description, DescriptionError, Invocation, operator_name, run_name, run_note,
};
pub(crate) use loop_check::closed_loop_of;
pub use loop_check::{MarginError, RatedController, Stage, closed_loop, require_margins};
pub use motion_model::residuals;
pub use motor_start::MotorStart;
pub use plan_error::PlanError;
pub(crate) use run_plan::{
    CALIBRATION, KIND, MOTOR_KNOWN_FROM, MOTOR_THERMAL, OVERRIDE, RAMP_TICKS,
};
pub use run_plan::{Plan, RunKind};
pub use tune_check::{TuneRefusal, check_tune};
