//! The closed loop of `bench control`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::excitation::ReferenceSettings;

/// The closed loop of `bench control`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlSettings {
    /// `fast`, `slow`, or the path of a TOML file with sections.
    pub controller: String,
    /// A loop with a smaller modulus margin (1/max|S|), or an unstable one, is refused; 0 refuses none.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub min_modulus_margin: f64,
    /// Zero current before the loop closes, in seconds; the mean position over it is the rest position, from which the reference counts.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub settle_s: f64,
    /// Length of the run after the loop closed, in seconds.
    #[schemars(range(min = 0.001, max = 1000000.0))]
    pub duration_s: f64,
    /// Seconds after the last change of the reference from which on the steady state is measured.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub steady_after_s: f64,
    /// The reference.
    pub reference: ReferenceSettings,
}
