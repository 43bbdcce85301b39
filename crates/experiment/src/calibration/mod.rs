//! Calibration by small static steps: scale, sign, offset and linearity of amplifier and probe, then a short chirp for the
//! delay from a command to its reading. `run` plans and evaluates the runs, and `staircase_fit` fits the static steps.

mod run;
mod staircase_fit;

pub use run::{CalibrationPlan, CalibrationRun, StaircaseResult, check, run, settings, staircase};
pub use staircase_fit::{StaircaseError, StaircaseFit, fit};
