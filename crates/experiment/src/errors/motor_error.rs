//! Why the motor does not allow a run.

use bench_rig::motor::MotorMemoryError;

/// A run that the motor does not allow, or whose wait was stopped. Nothing was moved.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MotorError {
    /// The motor is too warm at this time.
    #[error(
        "the motor is too warm for this run: {known_from}, so the thermal current would reach {peak_a:.3} A, above the limit of {limit_a:.3} A; {when}, or lower the amplitude{unless_cold}; nothing was moved"
    )]
    Warm {
        /// How the state is known.
        known_from: String,
        /// Predicted thermal current.
        peak_a: f64,
        /// Its limit.
        limit_a: f64,
        /// From when on the run is allowed, as an instruction.
        when: String,
        /// The remedy if the state is only assumed; may be empty.
        unless_cold: String,
    },
    /// Too much heat for any motor.
    #[error(
        "the thermal current would reach {peak_a:.3} A by the model, above the limit of {limit_a:.3} A, also with a cold motor; lower the amplitude or the duration; nothing was moved"
    )]
    Never {
        /// Predicted thermal current.
        peak_a: f64,
        /// Its limit.
        limit_a: f64,
    },
    /// The file.
    #[error("{0}; nothing was moved")]
    Memory(#[from] MotorMemoryError),
    /// A signal.
    #[error(
        "stopped while the run waited for the motor to cool; start it again; nothing was moved"
    )]
    Stopped,
}
