//! The errors of the crate: why an experiment was refused or failed, and which kind of error that is.
//!
//! Each step of an experiment has its own error, in its module; a run and a motor have theirs here (`run_error`, `motor_error`).
//! [`ExperimentError`] holds all of them, and `error_kind` carries them to another process.

mod error_kind;
mod experiment_error;
mod motor_error;
mod run_error;

pub use error_kind::{ErrorKind, ErrorObject, RemoteError, option_in};
pub use experiment_error::ExperimentError;
pub use motor_error::MotorError;
pub use run_error::RunError;
