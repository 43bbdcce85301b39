//! Why a command failed.

use serde::Serialize;

use super::exit::Exit;
use bench_config::ConfigError;
use bench_control::ControllerError;
use bench_control::tuning::TuneError;
use bench_excitation::ExcitationError;
use bench_experiment::campaign::CampaignError;
use bench_experiment::certificate::CertificateDefects;
use bench_experiment::stage_check::StageCheckError;
use bench_experiment::tuning::TuneSourceError;
use bench_experiment::{
    AnalysisError, FrfError, MarginError, MotorError, PlanError, RemoteError, RunError,
};
use bench_experiment::{ErrorKind, ErrorObject, ExperimentError, option_in};
use bench_external::ExternalCsvError;
use bench_identify::IdentifyError;
use bench_order::{ColumnsError, refused_option, usage_message};
use bench_plant::PlantError;
use bench_recording::RecordingError;
use bench_rig::calibration::CalibrationError;
use bench_rig::devices::DevicesError;
use bench_study::StudyError;

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
    /// A measured response cannot be used for a design.
    #[error(transparent)]
    TuneSource(#[from] TuneSourceError),
    /// No controller was designed.
    #[error(transparent)]
    Tune(#[from] TuneError),
    /// Any other failure.
    #[error("{0}")]
    Failed(String),
}

/// Errors that are those of an experiment.
macro_rules! experiment_errors {
    ($($error:ty),* $(,)?) => {
        $(impl From<$error> for CliError {
            fn from(error: $error) -> Self {
                CliError::Experiment(error.into())
            }
        })*
    };
}

experiment_errors!(
    ExperimentError,
    PlanError,
    MarginError,
    CertificateDefects,
    StageCheckError,
    ExcitationError,
    PlantError,
    DevicesError,
    CalibrationError,
    MotorError,
    RunError,
    RecordingError,
    AnalysisError,
    FrfError,
    RemoteError,
    ConfigError,
    ControllerError,
);

impl From<ColumnsError> for CliError {
    fn from(error: ColumnsError) -> Self {
        match error {
            ColumnsError::Options(error) => error.into(),
            ColumnsError::File(error) => error.into(),
            other => CliError::Failed(other.to_string()),
        }
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
    /// The exit code of the command: wrong usage and refused settings are distinguished from failures at run time.
    pub fn exit(&self) -> Exit {
        if self.is_failure() {
            Exit::Failed
        } else {
            Exit::Usage
        }
    }

    fn is_failure(&self) -> bool {
        match self {
            CliError::Experiment(error) => error.is_failure(),
            CliError::Identify(_) | CliError::Tune(_) | CliError::Failed(_) => true,
            CliError::Table(error) => !matches!(error, ExternalCsvError::Columns(_)),
            CliError::Campaign(error) => matches!(
                error,
                CampaignError::File { .. } | CampaignError::RestPosition { .. }
            ),
            CliError::TuneSource(error) => error.is_failure(),
            CliError::Study(error) => {
                matches!(error, StudyError::File { .. } | StudyError::Shards(_))
            }
            CliError::Usage(_) => false,
        }
    }

    /// The kind of the error.
    pub fn kind(&self) -> ErrorKind {
        match self {
            CliError::Experiment(error) => error.kind(),
            CliError::Usage(_) => ErrorKind::Usage,
            CliError::Identify(_) | CliError::Table(_) | CliError::TuneSource(_) => ErrorKind::Data,
            CliError::Study(_) => ErrorKind::Study,
            CliError::Campaign(_) => ErrorKind::Campaign,
            CliError::Tune(_) => ErrorKind::Controller,
            CliError::Failed(_) => ErrorKind::Failed,
        }
    }

    /// The option, file or line that is wrong, if the error has one.
    pub fn place(&self) -> Option<String> {
        match self {
            CliError::Experiment(error) => error.place(),
            CliError::Usage(message) => option_in(message),
            _ => None,
        }
    }
}

/// The JSON object of a command that failed.
#[derive(Debug, Serialize)]
pub(super) struct ErrorReport {
    error: ErrorObject,
}

impl ErrorReport {
    pub(super) fn of(error: &CliError) -> ErrorReport {
        match error {
            CliError::Experiment(error) => ErrorReport {
                error: error.object(),
            },
            _ => ErrorReport::new(error.to_string(), error.kind(), error.place()),
        }
    }

    /// The report of a command line that cannot be parsed.
    pub(super) fn of_usage(error: &clap::Error) -> ErrorReport {
        ErrorReport::new(
            usage_message(error),
            ErrorKind::Usage,
            refused_option(error),
        )
    }

    /// The text of the error.
    pub(super) fn message(&self) -> &str {
        &self.error.message
    }

    fn new(message: String, kind: ErrorKind, place: Option<String>) -> ErrorReport {
        ErrorReport {
            error: ErrorObject::new(message, kind, place),
        }
    }
}
