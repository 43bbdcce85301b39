//! Why a campaign was refused or failed.

use std::path::Path;

use crate::errors::ExperimentError;
use bench_base::checkpoint::{FileAction, FileError};
use bench_plant::PlantError;

/// A campaign that was refused or that failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CampaignError {
    /// The grid cannot be measured.
    #[error("{0}")]
    Grid(
        /// What is wrong, with the remedy.
        String,
    ),
    /// The model cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The folder holds a campaign with other settings.
    #[error("{folder} contains a campaign with other settings; choose another folder with --out, or use the same settings:\n{}", differences.join("\n"))]
    OtherSettings {
        /// The folder.
        folder: String,
        /// One line for each difference.
        differences: Vec<String>,
    },
    /// The settings file of the folder does not belong to a campaign.
    #[error(
        "{path} does not belong to a campaign ({why}) and was left unchanged; choose another folder with --out"
    )]
    NotACampaign {
        /// The file.
        path: String,
        /// What was found.
        why: String,
    },
    /// The folder gives no plants for a design.
    #[error("{folder} {why}")]
    Unusable {
        /// The folder.
        folder: String,
        /// What is wrong with it, with the remedy.
        why: String,
    },
    /// A zero-current run without a rest position.
    #[error(
        "{recording} does not contain a rest position: {why}; check the probe with `bench doctor`"
    )]
    RestPosition {
        /// The recording.
        recording: String,
        /// What was missing.
        why: String,
    },
    /// A file that cannot be written or read.
    #[error("{error}; {remedy}")]
    File {
        /// The file and the cause.
        error: FileError,
        /// What to do about it.
        remedy: &'static str,
    },
    /// A run was refused or failed.
    #[error(transparent)]
    Run(#[from] ExperimentError),
}

impl From<FileError> for CampaignError {
    fn from(error: FileError) -> Self {
        let remedy = match error.action {
            FileAction::Write => {
                "free some space and start the campaign again with the same arguments (the finished points are stored)"
            }
            FileAction::Use => "wait until that process ends, or choose another folder with --out",
            _ => "check that you may read and write the folder, or choose another with --out",
        };
        CampaignError::File { error, remedy }
    }
}

/// A failed step on a file.
pub(super) fn file_error(action: FileAction, path: &Path, cause: &std::io::Error) -> CampaignError {
    FileError::new(action, path, cause).into()
}
