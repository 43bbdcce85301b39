//! Why an experiment was refused or failed.

use super::error_kind::{ErrorKind, ErrorObject, RemoteError, option_in};
use super::motor_error::MotorError;
use super::run_error::RunError;
use crate::analysis::{AnalysisError, FrfError};
use crate::certificate::CertificateDefects;
use crate::plan::{MarginError, PlanError};
use crate::stage_check::StageCheckError;
use bench_config::ConfigError;
use bench_control::ControllerError;
use bench_excitation::ExcitationError;
use bench_plant::PlantError;
use bench_recording::RecordingError;
use bench_rig::calibration::CalibrationError;
use bench_rig::devices::DevicesError;

/// An experiment that was refused or that failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ExperimentError {
    /// The run cannot be planned.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The stability margin of the loop is too small.
    #[error(transparent)]
    Margin(#[from] MarginError),
    /// The certificate does not allow to close the loop.
    #[error(transparent)]
    Certificate(#[from] CertificateDefects),
    /// The stage does not agree with the certificate.
    #[error("refused before the loop closed: {0}, or add --override \"REASON\"")]
    StageCheck(#[from] StageCheckError),
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
    /// A measured plant cannot be used.
    #[error(transparent)]
    Frf(#[from] FrfError),
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

impl From<&ExperimentError> for RemoteError {
    fn from(error: &ExperimentError) -> RemoteError {
        RemoteError {
            error: error.object(),
            is_failure: error.is_failure(),
        }
    }
}

impl ExperimentError {
    /// Whether the experiment failed at run time, not because of its settings.
    pub fn is_failure(&self) -> bool {
        match self {
            ExperimentError::Run(_)
            | ExperimentError::StageCheck(_)
            | ExperimentError::Recording(_)
            | ExperimentError::Analysis(_)
            | ExperimentError::Failed(_)
            | ExperimentError::Motor(MotorError::Memory(_) | MotorError::Stopped) => true,
            ExperimentError::Remote(error) => error.is_failure,
            ExperimentError::Frf(error) => error.is_failure(),
            ExperimentError::Plan(_)
            | ExperimentError::Margin(_)
            | ExperimentError::Certificate(_)
            | ExperimentError::Excitation(_)
            | ExperimentError::Plant(_)
            | ExperimentError::Devices(_)
            | ExperimentError::Calibration(_)
            | ExperimentError::Motor(MotorError::Warm { .. } | MotorError::Never { .. })
            | ExperimentError::Refused(_) => false,
        }
    }

    /// The error as an object.
    pub fn object(&self) -> ErrorObject {
        match self {
            ExperimentError::Remote(error) => error.error.clone(),
            _ => ErrorObject {
                defects: self.defects(),
                ..ErrorObject::new(self.to_string(), self.kind(), self.place())
            },
        }
    }

    /// The texts of the defects of a certificate.
    fn defects(&self) -> Box<[String]> {
        match self {
            ExperimentError::Certificate(defects) => {
                defects.as_slice().iter().map(ToString::to_string).collect()
            }
            _ => Box::default(),
        }
    }

    /// The kind of the error.
    pub fn kind(&self) -> ErrorKind {
        match self {
            ExperimentError::Plan(PlanError::Config(_)) => ErrorKind::Configuration,
            ExperimentError::Plan(PlanError::Controller(_)) => ErrorKind::Controller,
            ExperimentError::Plan(PlanError::Certificate(_))
            | ExperimentError::Certificate(_)
            | ExperimentError::StageCheck(_) => ErrorKind::Certificate,
            ExperimentError::Plan(_) | ExperimentError::Excitation(_) => ErrorKind::Plan,
            ExperimentError::Motor(error) => motor_kind(error),
            ExperimentError::Margin(_) => ErrorKind::Margin,
            ExperimentError::Plant(_) => ErrorKind::Model,
            ExperimentError::Devices(_) => ErrorKind::Devices,
            ExperimentError::Calibration(_) => ErrorKind::Calibration,
            ExperimentError::Refused(_) => ErrorKind::Usage,
            ExperimentError::Recording(_) => ErrorKind::Recording,
            ExperimentError::Run(_) | ExperimentError::Analysis(_) | ExperimentError::Failed(_) => {
                ErrorKind::Failed
            }
            ExperimentError::Frf(_) => ErrorKind::Data,
            ExperimentError::Remote(error) => error.error.kind,
        }
    }

    /// The option, file or line that is wrong, if the error has one.
    pub fn place(&self) -> Option<String> {
        match self {
            ExperimentError::Plan(PlanError::Config(error)) => error.place(),
            ExperimentError::Refused(message) => option_in(message),
            ExperimentError::Remote(error) => error.error.place.clone(),
            _ => None,
        }
    }
}

fn motor_kind(error: &MotorError) -> ErrorKind {
    match error {
        MotorError::Warm { .. } | MotorError::Never { .. } => ErrorKind::Plan,
        MotorError::Memory(_) | MotorError::Stopped => ErrorKind::Failed,
    }
}
