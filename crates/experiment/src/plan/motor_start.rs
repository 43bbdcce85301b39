//! The thermal state of the motor with which a run starts.

use serde::{Deserialize, Serialize};

/// The thermal state with which a run starts.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MotorStart {
    /// The state in A^2.
    pub thermal_a2: f64,
    /// How it is known, as text.
    pub known_from: String,
}
