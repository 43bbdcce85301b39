//! The choice of the excitation.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use bench_excitation::ExcitationKind;

/// The choice of the excitation of `bench chirp`. Band, rest times, fades and amplitude over frequency of all kinds
/// are in `[chirp]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExcitationSettings {
    /// Kind of the excitation.
    pub kind: ExcitationKind,
}

/// The target of `bench chirp --shape`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapeSettings {
    /// Amplitude of the displacement in metres; a third of `interlock.soft_limit_m` if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-12, max = 1.0))]
    pub travel_m: Option<f64>,
    /// Largest current, as a ratio of the current that motor and amplifier allow.
    #[schemars(range(min = 0.001, max = 1.0))]
    pub current_ratio: f64,
}
