//! Why a controller is refused.

use super::import_error::ImportError;
use super::section_settings::SectionsError;
use super::transfer::TransferError;
use bench_settings::ConfigError;

/// A controller that is refused, before any motion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ControllerError {
    /// The file is missing or not TOML, or its keys, types and ranges are wrong.
    #[error(transparent)]
    File(#[from] ConfigError),
    /// Invalid sections.
    #[error("{name}: {why}")]
    Sections {
        /// The controller.
        name: String,
        /// What is wrong.
        why: SectionsError,
    },
    /// A law whose settings are inconsistent with each other or with the servo rate.
    #[error("{name}: `law` {why}")]
    Law {
        /// The controller.
        name: String,
        /// What is wrong.
        why: String,
    },
    /// A transfer function that cannot be used.
    #[error("{name}: `{table}`: {why}")]
    Transfer {
        /// The controller.
        name: String,
        /// The table.
        table: &'static str,
        /// What is wrong.
        why: TransferError,
    },
    /// A file of another program that cannot be imported.
    #[error(transparent)]
    Import(#[from] ImportError),
    /// A law of another kind where sections are needed.
    #[error(
        "the controller is not a cascade of continuous sections; choose one with `[[section]]` tables, or with `[tf]`, `[zpk]` or `[ss]` without `rate_hz`, which this command needs"
    )]
    NotSections,
    /// A law without a linear description.
    #[error(
        "the control law offers no linear description, so its stability and margins cannot be computed; choose another controller"
    )]
    NotLinear,
}
