//! Why a command failed.

use clap::error::ContextKind;
use serde::Serialize;

use super::outcome::Outcome;
use crate::experiment::campaign::CampaignError;
use crate::experiment::{ExperimentError, MotorError, PlanError};
use crate::identify::IdentifyError;
use crate::identify::external_csv::ExternalCsvError;
use crate::model::study::StudyError;
use crate::util::remedy;

/// Why a command failed.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// A configuration, model, device, run or recording is refused, or failed.
    #[error(transparent)]
    Experiment(ExperimentError),
    /// Wrong options or arguments.
    #[error("{0}")]
    Usage(String),
    /// The data do not allow the analysis.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The external CSV file cannot be used.
    #[error(transparent)]
    Table(#[from] ExternalCsvError),
    /// The study is refused, or its file cannot be used.
    #[error(transparent)]
    Study(#[from] StudyError),
    /// The campaign is refused, or its files cannot be used.
    #[error(transparent)]
    Campaign(CampaignError),
    /// Any other failure.
    #[error("{0}")]
    Failed(String),
}

/// The kinds of error that a script can distinguish.
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

impl<E: Into<ExperimentError>> From<E> for CliError {
    fn from(error: E) -> Self {
        CliError::Experiment(error.into())
    }
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

impl CliError {
    /// The outcome of the command: wrong usage and refused settings are distinguished from failures at run time.
    pub fn outcome(&self) -> Outcome {
        match self.is_failure() {
            true => Outcome::Failed,
            false => Outcome::Usage,
        }
    }

    fn is_failure(&self) -> bool {
        match self {
            CliError::Experiment(error) => is_failure(error),
            CliError::Identify(_) | CliError::Failed(_) => true,
            CliError::Table(error) => !matches!(error, ExternalCsvError::Columns(_)),
            CliError::Campaign(error) => matches!(
                error,
                CampaignError::File { .. } | CampaignError::RestPosition { .. }
            ),
            CliError::Study(error) => {
                matches!(error, StudyError::File { .. } | StudyError::Shards(_))
            }
            CliError::Usage(_) => false,
        }
    }

    /// The kind of the error.
    pub fn kind(&self) -> ErrorKind {
        match self {
            CliError::Experiment(error) => experiment_kind(error),
            CliError::Usage(_) => ErrorKind::Usage,
            CliError::Identify(_) | CliError::Table(_) => ErrorKind::Data,
            CliError::Study(_) => ErrorKind::Study,
            CliError::Campaign(_) => ErrorKind::Campaign,
            CliError::Failed(_) => ErrorKind::Failed,
        }
    }

    /// The option, file or line that is wrong, if the error has one.
    pub fn place(&self) -> Option<String> {
        match self {
            CliError::Experiment(ExperimentError::Plan(PlanError::Config(error))) => error.place(),
            CliError::Experiment(ExperimentError::Refused(message)) | CliError::Usage(message) => {
                option_in(message)
            }
            _ => None,
        }
    }
}

/// Whether an experiment failed at run time, not because of its settings.
fn is_failure(error: &ExperimentError) -> bool {
    matches!(
        error,
        ExperimentError::Run(_)
            | ExperimentError::Recording(_)
            | ExperimentError::Analysis(_)
            | ExperimentError::Failed(_)
            | ExperimentError::Motor(MotorError::Memory(_) | MotorError::Stopped)
    )
}

fn experiment_kind(error: &ExperimentError) -> ErrorKind {
    match error {
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
    }
}

fn motor_kind(error: &MotorError) -> ErrorKind {
    match error {
        MotorError::Warm { .. } | MotorError::Never { .. } => ErrorKind::Plan,
        MotorError::Memory(_) | MotorError::Stopped => ErrorKind::Failed,
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

    /// The report of a command line that cannot be parsed.
    pub(super) fn of_usage(error: &clap::Error) -> ErrorReport {
        let argument = error.get(ContextKind::InvalidArg);
        let place = argument.map(|argument| argument.to_string());
        ErrorReport::new(usage_message(error), ErrorKind::Usage, place)
    }

    /// The text of the error.
    pub(super) fn message(&self) -> &str {
        &self.error.message
    }

    fn new(message: String, kind: ErrorKind, place: Option<String>) -> ErrorReport {
        let remedy = remedy::split(&message).1.map(String::from);
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

/// The first paragraph of the parser's message, on one line and with a remedy: the messages of our own value parsers have
/// one already.
fn usage_message(error: &clap::Error) -> String {
    let text = error.to_string();
    let paragraph = text.split("\n\n").next().unwrap_or_default();
    let words: Vec<&str> = paragraph.split_whitespace().collect();
    let what = words.join(" ");
    let what = what.strip_prefix("error: ").unwrap_or(&what);
    let suggestions = [
        ContextKind::SuggestedArg,
        ContextKind::SuggestedSubcommand,
        ContextKind::SuggestedValue,
    ];
    let suggested = suggestions.into_iter().find_map(|kind| error.get(kind));
    match (remedy::split(what).1, suggested) {
        (Some(_), _) => what.to_string(),
        (None, Some(suggested)) => remedy::join(what, &format!("use {suggested}, or see --help")),
        (None, None) => remedy::join(what, "see --help for the arguments"),
    }
}
