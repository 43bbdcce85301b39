//! Runs plans: from a plan to a recording and its summary, on an own rig or on that of another process.
//!
//! The files of a configuration are checked (`named_files`). A [`Runner`] then looks how warm the motor is (`remembered_motor`), checks
//! the stage before a loop closes (`planned_stage_check`), and runs the plan or sends it to the owner of the rig (`planned_run`);
//! `run_summary` summarises the run.

mod named_files;
mod planned_run;
mod planned_stage_check;
mod remembered_motor;
mod run_summary;
mod runner;

pub use named_files::{check_calibration, check_named_files};
pub use planned_run::{PlannedRun, RigOwner, RunConditions, RunReport};
pub use planned_stage_check::PlannedStageCheck;
pub use remembered_motor::MotorHandling;
pub use run_summary::{RunSummary, TimingSummary, TripSummary};
pub use runner::{Runner, Setup, close};
