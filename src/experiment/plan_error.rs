//! Why a run cannot be planned.

use super::certificate::CertificateError;
use crate::config::ConfigError;
use crate::control::ControllerError;
use crate::excitation::{ExcitationError, ReferenceError};
use crate::model::plant::PlantError;

/// A run that cannot be planned.
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
    /// The certificate cannot be read.
    #[error("refused: {0}; nothing was moved")]
    Certificate(#[from] CertificateError),
    /// The model that a swept reference is planned from cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A swept reference that would trip an interlock by the model.
    #[error(transparent)]
    Excitation(#[from] ExcitationError),
    /// A swept reference for a loop that is unstable by the model.
    #[error(
        "the closed loop is unstable in the model, so a swept reference would trip an interlock; choose another controller, operating point or asymmetry (check it with `bench margins`)"
    )]
    Unstable,
    /// The recording lacks a part of the plan.
    #[error(
        "the recording has no {0}: it was not made by `bench chirp` or `bench control`, or that part was damaged; choose another recording"
    )]
    Missing(&'static str),
    /// The recorded thermal state of the motor is not a number.
    #[error(
        "the recording has the damaged thermal state of the motor `{0}`; choose another recording"
    )]
    MotorThermal(String),
    /// The configuration cannot be written as TOML.
    #[error("the configuration cannot be written as TOML: {0}; report this with the configuration")]
    Text(String),
}
