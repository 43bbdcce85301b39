//! Kinds of error, and errors of another process.

use serde::{Deserialize, Serialize};

use super::error::ExperimentError;
use super::motor_error::MotorError;
use super::plan_error::PlanError;
use crate::util::remedy;

/// The kinds of error that a script can distinguish.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ErrorKind {
    /// Wrong options or arguments.
    Usage,
    /// A setting is refused, or a configuration cannot be read.
    Configuration,
    /// The controller is refused.
    Controller,
    /// The excitation or the run is refused.
    Plan,
    /// The model cannot be analysed.
    Model,
    /// The devices cannot be opened, or differ from their settings.
    Devices,
    /// The calibration cannot be used.
    Calibration,
    /// The stability margin of the loop is too small.
    Margin,
    /// A recording cannot be written or read.
    Recording,
    /// The data do not allow the analysis.
    Data,
    /// A study is refused, or its file cannot be used.
    Study,
    /// A campaign is refused, or its files cannot be used.
    Campaign,
    /// Any other failure at run time.
    Failed,
}

/// An error as an object: in the JSON of a command, and in the answers of the daemon.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct ErrorObject {
    /// What is wrong and what to do.
    pub message: String,
    /// Kind of the error.
    pub kind: ErrorKind,
    /// The option, file or line that is wrong, if the error has one.
    #[serde(rename = "where")]
    pub place: Option<String>,
    /// What to do, as part of the message.
    pub remedy: Option<String>,
}

impl ErrorObject {
    /// An error with its remedy, which is the part of the message after the last semicolon.
    pub fn new(message: String, kind: ErrorKind, place: Option<String>) -> ErrorObject {
        let remedy = remedy::split(&message).1.map(String::from);
        ErrorObject {
            message,
            kind,
            place,
            remedy,
        }
    }
}

/// An error of the daemon.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error("{}", error.message)]
pub struct RemoteError {
    /// The error.
    pub error: ErrorObject,
    /// Whether it is a failure at run time; otherwise settings or options were refused.
    pub is_failure: bool,
}

impl RemoteError {
    /// A failure at run time.
    pub fn failed(message: String) -> RemoteError {
        RemoteError {
            error: ErrorObject::new(message, ErrorKind::Failed, None),
            is_failure: true,
        }
    }
}

impl From<&ExperimentError> for RemoteError {
    fn from(error: &ExperimentError) -> RemoteError {
        RemoteError {
            error: ErrorObject::new(error.to_string(), error.kind(), error.place()),
            is_failure: error.is_failure(),
        }
    }
}

impl ExperimentError {
    /// Whether the experiment failed at run time, not because of its settings.
    pub fn is_failure(&self) -> bool {
        match self {
            ExperimentError::Run(_)
            | ExperimentError::Recording(_)
            | ExperimentError::Analysis(_)
            | ExperimentError::Failed(_)
            | ExperimentError::Motor(MotorError::Memory(_) | MotorError::Stopped) => true,
            ExperimentError::Remote(error) => error.is_failure,
            ExperimentError::Plan(_)
            | ExperimentError::Margin(_)
            | ExperimentError::Excitation(_)
            | ExperimentError::Plant(_)
            | ExperimentError::Devices(_)
            | ExperimentError::Calibration(_)
            | ExperimentError::Motor(MotorError::Warm { .. } | MotorError::Never { .. })
            | ExperimentError::Refused(_) => false,
        }
    }

    /// The kind of the error.
    pub fn kind(&self) -> ErrorKind {
        match self {
            ExperimentError::Plan(PlanError::Config(_)) => ErrorKind::Configuration,
            ExperimentError::Plan(PlanError::Controller(_)) => ErrorKind::Controller,
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

/// The first option that a message names.
pub fn option_in(message: &str) -> Option<String> {
    let words = message.split([' ', ':', ',', '`', '\'']);
    let option = words
        .into_iter()
        .find(|word| word.len() > 2 && word.starts_with("--"));
    option.map(str::to_string)
}
