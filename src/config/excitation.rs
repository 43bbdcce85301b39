//! The choice of the excitation.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::excitation::ExcitationKind;

/// Which excitation `bench chirp` uses. `[chirp]` holds band, quiet before and after, fades and amplitude over frequency of
/// all kinds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExcitationSettings {
    /// Which kind.
    pub kind: ExcitationKind,
}

/// What `bench chirp --shape` aims at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ShapeSettings {
    /// Amplitude of the displacement in metres; a third of `interlock.soft_limit_m` if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-12, max = 1.0))]
    pub travel_m: Option<f64>,
    /// Share of what motor and amplifier allow that the current may have.
    #[schemars(range(min = 0.001, max = 1.0))]
    pub current_ratio: f64,
}
