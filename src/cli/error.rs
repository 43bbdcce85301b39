//! Why a command failed.

use clap::error::ContextKind;
use serde::Serialize;

use super::outcome::Outcome;
use crate::config::ConfigError;
use crate::control::ControllerError;
use crate::excitation::ExcitationError;
use crate::experiment::campaign::CampaignError;
use crate::experiment::{ExperimentError, PlanError};
use crate::identify::IdentifyError;
use crate::identify::external_csv::ExternalCsvError;
use crate::model::plant::PlantError;
use crate::model::study::StudyError;
use crate::recording::RecordingError;
use crate::rig::calibration::CalibrationError;
use crate::rig::devices::DevicesError;

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// The configuration is refused.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The controller is refused.
    #[error(transparent)]
    Controller(#[from] ControllerError),
    /// The run cannot be planned.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The excitation would trip an interlock.
    #[error(transparent)]
    Excitation(#[from] ExcitationError),
    /// The model cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The devices cannot be opened, or cannot be as configured.
    #[error(transparent)]
    Devices(#[from] DevicesError),
    /// The calibration may not be used.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// The loop's margin is too small.
    #[error(
        "refused: {0}; choose a controller designed for this rate and delay (--controller FILE), or lower control.min_modulus_margin if you know better; nothing moved"
    )]
    Margin(String),
    /// Another mistake in the call.
    #[error("{0}")]
    Usage(String),
    /// The recording cannot be written or read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The data do not carry the analysis.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The table is no record.
    #[error(transparent)]
    Table(#[from] ExternalCsvError),
    /// There is no such study, or its file cannot be used.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// The campaign's grid or folder is refused, or its files cannot be written.
    #[error(transparent)]
    Campaign(CampaignError),
    /// Something else went wrong on the way.
    #[error("{0}")]
    Failed(String),
}

/// The kinds of error, by which a script can tell them apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
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
    /// The devices cannot be opened, or not as configured.
    Devices,
    /// The calibration cannot be used.
    Calibration,
    /// The loop has too little stability margin.
    Margin,
    /// A recording cannot be written or read.
    Recording,
    /// The data carry no such analysis.
    Data,
    /// A study is refused, or its file cannot be used.
    Study,
    /// A campaign is refused, or its files cannot be used.
    Campaign,
    /// Anything else, at run time.
    Failed,
}

impl From<CampaignError> for CliError {
    fn from(error: CampaignError) -> Self {
        match error {
            CampaignError::Plant(error) => error.into(),
            CampaignError::Run(error) => error.into(),
            other => CliError::Campaign(other),
        }
    }
}

impl From<ExperimentError> for CliError {
    fn from(error: ExperimentError) -> Self {
        match error {
            ExperimentError::Plan(error) => error.into(),
            ExperimentError::Excitation(error) => error.into(),
            ExperimentError::Plant(error) => error.into(),
            ExperimentError::Devices(error) => error.into(),
            ExperimentError::Calibration(error) => error.into(),
            ExperimentError::Recording(error) => error.into(),
            ExperimentError::Refused(what) => CliError::Usage(what),
            other => CliError::Failed(other.to_string()),
        }
    }
}

impl CliError {
    /// Wrong usage and configurations are told apart from failures at run time.
    pub fn outcome(&self) -> Outcome {
        match self {
            CliError::Recording(_) | CliError::Identify(_) | CliError::Failed(_) => Outcome::Failed,
            CliError::Table(ExternalCsvError::Columns(_)) => Outcome::Usage,
            CliError::Table(_) => Outcome::Failed,
            CliError::Campaign(CampaignError::File { .. } | CampaignError::RestPosition { .. }) => {
                Outcome::Failed
            }
            CliError::Study(StudyError::File { .. } | StudyError::Shards(_)) => Outcome::Failed,
            _ => Outcome::Usage,
        }
    }

    /// The kind of the error.
    pub fn kind(&self) -> ErrorKind {
        match self {
            CliError::Usage(_) => ErrorKind::Usage,
            CliError::Config(_) | CliError::Plan(PlanError::Config(_)) => ErrorKind::Configuration,
            CliError::Controller(_) | CliError::Plan(PlanError::Controller(_)) => {
                ErrorKind::Controller
            }
            CliError::Plan(_) | CliError::Excitation(_) => ErrorKind::Plan,
            CliError::Plant(_) => ErrorKind::Model,
            CliError::Devices(_) => ErrorKind::Devices,
            CliError::Calibration(_) => ErrorKind::Calibration,
            CliError::Margin(_) => ErrorKind::Margin,
            CliError::Recording(_) => ErrorKind::Recording,
            CliError::Identify(_) | CliError::Table(_) => ErrorKind::Data,
            CliError::Study(_) => ErrorKind::Study,
            CliError::Campaign(_) => ErrorKind::Campaign,
            CliError::Failed(_) => ErrorKind::Failed,
        }
    }

    /// The option, file or line that is wrong, if the error has one.
    pub fn place(&self) -> Option<String> {
        match self {
            CliError::Config(error) | CliError::Plan(PlanError::Config(error)) => error.place(),
            CliError::Usage(message) => option_in(message),
            _ => None,
        }
    }
}

/// The first option that a message names.
fn option_in(message: &str) -> Option<String> {
    let words = message.split([' ', ':', ',', '`', '\'']);
    let option = words
        .into_iter()
        .find(|word| word.len() > 2 && word.starts_with("--"));
    option.map(str::to_string)
}

/// The JSON object of a command that failed.
#[derive(Debug, Serialize)]
pub(super) struct ErrorReport {
    error: ErrorObject,
}

#[derive(Debug, Serialize)]
struct ErrorObject {
    message: String,
    kind: ErrorKind,
    #[serde(rename = "where")]
    place: Option<String>,
    remedy: Option<String>,
}

impl ErrorReport {
    pub(super) fn of(error: &CliError) -> ErrorReport {
        ErrorReport::new(error.to_string(), error.kind(), error.place())
    }

    /// Of a command line that cannot be parsed.
    pub(super) fn of_usage(error: &clap::Error) -> ErrorReport {
        let message = error.to_string();
        let argument = error.get(ContextKind::InvalidArg);
        let place = argument.map(|argument| argument.to_string());
        ErrorReport::new(message.trim_end().into(), ErrorKind::Usage, place)
    }

    /// Messages say first what is wrong and, after a semicolon, what to do.
    fn new(message: String, kind: ErrorKind, place: Option<String>) -> ErrorReport {
        let remedy = message
            .split_once("; ")
            .map(|(_, remedy)| remedy.to_string());
        ErrorReport {
            error: ErrorObject {
                message,
                kind,
                place,
                remedy,
            },
        }
    }
}
