//! What a run will do and demand of rig and motor, by the model, before it starts.
//!
//! First the extremes of an excitation (`prediction`) and the amplitudes that they allow (`amplitude_plan`), then the heat of the motor
//! (`motor_forecast`). Of a closed loop the response to its reference (`predicted_step`, `predicted_sine`). Each has a summary for the
//! operator, which is the JSON of `--plan`: `excitation_plan`, `control_forecast`, `calibration_forecast`.

mod amplitude_plan;
mod calibration_forecast;
mod control_forecast;
mod excitation_plan;
mod motor_forecast;
mod predicted_sine;
mod predicted_step;
mod prediction;

pub use amplitude_plan::{AmplitudePlanError, ResponseSource, default_amplitude, shape_amplitude};
pub(crate) use amplitude_plan::{limit_travel, shape_travel_m};
pub use calibration_forecast::{CalibrationForecast, ExpectedExtremes};
pub use control_forecast::{ControlForecast, PredictedLoop};
pub use excitation_plan::{ExcitationPlan, PlanLimits};
pub use motor_forecast::{MotorForecast, MotorSummary};
pub(crate) use motor_forecast::{RESERVE, duration_text, predict};
pub use predicted_sine::PredictedSine;
pub(crate) use predicted_step::MAX_STEP_TICKS;
pub use predicted_step::{PredictedStep, predicted_step};
pub use prediction::{extremes, predicted_extremes, rig_model};
