//! How a command ended, and its exit code.

use std::process::ExitCode;

use crate::config::ConfigError;
use crate::control::ControllerError;
use crate::excitation::ExcitationError;
use crate::experiment::PlanError;
use crate::experiment::campaign::{AnswerError, CampaignError};
use crate::identify::IdentifyError;
use crate::identify::table::ExternalCsvError;
use crate::model::plant::PlantError;
use crate::model::study::StudyError;
use crate::recording::RecordingError;
use crate::rig::calibration::CalibrationError;
use crate::rig::devices::DevicesError;

/// How a command ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// All done.
    Done,
    /// Ran, but did not reach its end: tripped, stopped, different.
    Failed,
    /// Wrong usage or configuration; nothing moved.
    Usage,
    /// Done, but with overruns or lost records.
    Impaired,
}

impl From<Outcome> for ExitCode {
    fn from(outcome: Outcome) -> ExitCode {
        ExitCode::from(match outcome {
            Outcome::Done => 0,
            Outcome::Failed => 1,
            Outcome::Usage => 2,
            Outcome::Impaired => 3,
        })
    }
}

/// Why a command gave up.
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
        "refused: {0}; choose a controller designed for this rate and delay (--controller FILE), or lower control.least_modulus_margin if you know better; nothing moved"
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
    Campaign(#[from] CampaignError),
    /// The campaign's points are there, but the model cannot be analysed.
    #[error(transparent)]
    Answer(#[from] AnswerError),
    /// Something else went wrong on the way.
    #[error("{0}")]
    Failed(String),
}

impl CliError {
    /// Usage and configuration are the caller's, all else is a failure.
    pub fn outcome(&self) -> Outcome {
        match self {
            CliError::Recording(_) | CliError::Identify(_) | CliError::Failed(_) => Outcome::Failed,
            CliError::Table(
                ExternalCsvError::NoColumn { .. }
                | ExternalCsvError::Ambiguous { .. }
                | ExternalCsvError::Same { .. },
            ) => Outcome::Usage,
            CliError::Table(_) => Outcome::Failed,
            CliError::Campaign(CampaignError::File { .. } | CampaignError::Rest { .. }) => {
                Outcome::Failed
            }
            CliError::Study(StudyError::File { .. } | StudyError::Shards(_)) => Outcome::Failed,
            _ => Outcome::Usage,
        }
    }
}
