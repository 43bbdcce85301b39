//! Why an experiment was refused or failed.

use super::analysis_error::AnalysisError;
use super::error_kind::RemoteError;
use super::loop_check::MarginError;
use super::motor_error::MotorError;
use super::plan_error::PlanError;
use super::run_error::RunError;
use crate::config::ConfigError;
use crate::control::ControllerError;
use crate::excitation::ExcitationError;
use crate::model::plant::PlantError;
use crate::recording::RecordingError;
use crate::rig::calibration::CalibrationError;
use crate::rig::devices::DevicesError;

/// An experiment that was refused or that failed.
#[derive(Debug, thiserror::Error)]
pub enum ExperimentError {
    /// The run cannot be planned.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The stability margin of the loop is too small.
    #[error(transparent)]
    Margin(#[from] MarginError),
    /// The excitation would trip an interlock by the model.
    #[error(transparent)]
    Excitation(#[from] ExcitationError),
    /// The model cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The devices cannot be opened, or do not match their settings.
    #[error(transparent)]
    Devices(#[from] DevicesError),
    /// The calibration cannot be used.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// The motor is too warm for the run, or its stored state cannot be used.
    #[error(transparent)]
    Motor(#[from] MotorError),
    /// The settings do not allow the experiment.
    #[error("{0}")]
    Refused(String),
    /// The run or its recording failed.
    #[error(transparent)]
    Run(RunError),
    /// The recording cannot be written or read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recording does not contain a frequency response.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// Another failure.
    #[error("{0}")]
    Failed(String),
    /// The daemon refused the run, or it failed there.
    #[error(transparent)]
    Remote(#[from] RemoteError),
}

impl From<ConfigError> for ExperimentError {
    fn from(error: ConfigError) -> Self {
        PlanError::from(error).into()
    }
}

impl From<ControllerError> for ExperimentError {
    fn from(error: ControllerError) -> Self {
        PlanError::from(error).into()
    }
}

impl From<RunError> for ExperimentError {
    fn from(error: RunError) -> Self {
        match error {
            RunError::Plan(error) => error.into(),
            other => ExperimentError::Run(other),
        }
    }
}
