//! What an input is, as the cause of the force.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The force, or the current or the voltage of the coil that makes it.
///
/// ```text
/// F = k i                                      k the force constant
/// U = R i + L di/dt + k v                      v the velocity of the coil
/// Y/U = k G_y/(R + s L + s k^2 G_x)            with the responses G to a force, of the coil G_x and of the probe G_y
/// ```
///
/// The responses to force and current have the modes of the stage. That to a voltage has a real pole near R/L as well, and its modes have
/// the damping of the induced voltage, which acts at the coil alone: their residues are complex. Its zeros are those of the stage.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum InputKind {
    /// The force, as of a load cell.
    Force,
    /// The current of the coil, or the command of a current amplifier.
    Current,
    /// The voltage of the coil, or the command of a voltage amplifier.
    Voltage,
}

impl InputKind {
    /// `force`, `current` or `voltage`.
    pub fn name(self) -> &'static str {
        match self {
            InputKind::Force => "force",
            InputKind::Current => "current",
            InputKind::Voltage => "voltage",
        }
    }
}
