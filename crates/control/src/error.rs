//! Why a controller is refused.

use super::import_error::ImportError;
use super::section::SectionError;
use super::transfer::TransferError;
use super::unstable::{MAX_INTEGRATORS, WHY_TWO};
use bench_settings::ConfigError;

/// A controller that is refused, before any motion.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ControllerError {
    /// The file is missing or not TOML, or its keys, types and ranges are wrong.
    #[error(transparent)]
    File(#[from] ConfigError),
    /// An invalid section.
    #[error("{name}: section {number} {why}")]
    Section {
        /// The controller.
        name: String,
        /// Number of the section, from 1.
        number: usize,
        /// What is wrong.
        why: SectionError,
    },
    /// More integrators than a controller may have.
    #[error(
        "{name}: its sections have {count} integrators (poles at s = 0); the limit is {MAX_INTEGRATORS}, because {WHY_TWO}"
    )]
    Integrators {
        /// The controller.
        name: String,
        /// Their number.
        count: usize,
    },
    /// A prewarping frequency above half the servo rate.
    #[error(
        "{name}: section {number} is prewarped at {prewarp_rad_s} rad/s, but the limit at this servo rate is {limit_rad_s:.1} rad/s; lower the frequency, or raise loop.rate_hz"
    )]
    Prewarp {
        /// The controller.
        name: String,
        /// Number of the section, from 1.
        number: usize,
        /// As given.
        prewarp_rad_s: f64,
        /// Half the servo rate.
        limit_rad_s: f64,
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
