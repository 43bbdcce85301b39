//! Why a run cannot be planned.

use crate::config::ConfigError;
use crate::control::ControllerError;
use crate::excitation::{ExcitationError, ReferenceError};
use crate::model::plant::PlantError;

/// A run that cannot be made.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// The configuration is refused.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The controller is refused.
    #[error(transparent)]
    Controller(#[from] ControllerError),
    /// The reference is refused.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The model that a swept reference is planned from cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A swept reference that the interlocks would trip.
    #[error(transparent)]
    Excitation(#[from] ExcitationError),
    /// A swept reference for a loop that runs away by the model.
    #[error(
        "by the model this loop is unstable: a swept reference would run away until an interlock trips; `bench margins` shows the loop; choose a controller, an operating point or an asymmetry with which it is stable"
    )]
    Unstable,
    /// A recording without what a plan needs.
    #[error("the recording has no {0}: it was not made by `bench chirp` or `bench control`")]
    Missing(&'static str),
    /// A configuration that cannot be written down.
    #[error("the configuration cannot be written as TOML: {0}")]
    Text(String),
}
