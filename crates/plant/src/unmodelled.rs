//! What acts on a stage beside the modes of its model.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A mode of the rig that is not in the model of the plant.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct UnmodelledMode {
    /// Natural frequency in hertz.
    #[schemars(range(min = 0.01, max = 1e5))]
    pub frequency_hz: f64,
    /// Damping ratio.
    #[schemars(range(min = 0.0, max = 0.99))]
    pub damping_ratio: f64,
    /// Residue from force to displacement in 1/kg, with its sign.
    #[schemars(range(min = -1e6, max = 1e6))]
    pub residue_per_kg: f64,
}

/// White noise filtered by the band-pass 2 zeta w s/(s^2 + 2 zeta w s + w^2) and scaled to an RMS acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FloorLine {
    /// Centre frequency in hertz.
    #[schemars(range(min = 0.01, max = 1e5))]
    pub frequency_hz: f64,
    /// Damping ratio zeta: the full width of the line at half power is 2 zeta times its frequency.
    #[schemars(range(min = 1e-4, max = 0.99))]
    pub damping_ratio: f64,
    /// RMS of the line in m/s^2.
    #[schemars(range(min = 0.0, max = 100.0))]
    pub acceleration_rms_m_per_s2: f64,
}
