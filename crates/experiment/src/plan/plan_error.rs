//! Why a run cannot be planned.

use crate::certificate::CertificateError;
use bench_config::ConfigError;
use bench_control::{ControllerError, MinimumTimeError};
use bench_excitation::command::CommandFilterError;
use bench_excitation::{ExcitationError, ReferenceError};
use bench_plant::PlantError;

/// A run that cannot be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
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
    /// A command for a loop that is unstable by the model.
    #[error(
        "the closed loop is unstable in the model (of one of the planned plants), so shaping and feedforward cannot be planned; choose another controller or a narrower range of plants (check it with `bench margins`)"
    )]
    UnstableCommand,
    /// The filters of the command cannot run.
    #[error(transparent)]
    CommandFilter(#[from] CommandFilterError),
    /// The step cannot be planned within its limits.
    #[error(transparent)]
    MinimumTime(#[from] MinimumTimeError),
    /// The closed loop has no mode to shape.
    #[error(
        "the closed loop has no lightly damped mode that answers a step with 1 % of its height, so there is no vibration to shape; leave the shaper out, or give control.shaper.modes"
    )]
    NoVibration,
    /// Operating points for a model that has none.
    #[error(
        "control.shaper.operating_points_m is for models with an operating point, and this model has none; leave it out"
    )]
    NoOperatingPoint,
    /// The margin for noise is larger than the settling band.
    #[error(
        "the settling band of 2 % of the step is {:.3} um, not above the margin for noise of {:.3} um (control.shaper.margin_m); choose a larger step, or lower the margin",
        .band_m * 1e6,
        .margin_m * 1e6
    )]
    NoBand {
        /// The settling band in metres.
        band_m: f64,
        /// The margin in metres.
        margin_m: f64,
    },
    /// Too many blocks of constant reference.
    #[error(
        "control.shaper.longest_s contains {blocks} blocks of control.shaper.block_s, above the limit of 400; raise block_s, or lower longest_s"
    )]
    ManyBlocks {
        /// Their number.
        blocks: usize,
    },
    /// The recording lacks a part of the plan.
    #[error(
        "the recording has no {0}: it was not made by `bench chirp` or `bench control`, or that part was damaged; choose another recording"
    )]
    Missing(&'static str),
    /// The recorded command cannot be read.
    #[error(
        "the command of the recording (attachment `command.toml`) is damaged: {0}; choose another recording"
    )]
    DamagedCommand(String),
    /// The recorded thermal state of the motor is not a number.
    #[error(
        "the recording has the damaged thermal state of the motor `{0}`; choose another recording"
    )]
    MotorThermal(String),
    /// The configuration cannot be written as TOML.
    #[error("the configuration cannot be written as TOML: {0}; report this with the configuration")]
    Text(String),
}
