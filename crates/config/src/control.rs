//! The closed loop of `bench control`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::command::{FeedforwardSettings, PrefilterSettings, ShaperSettings};
use bench_excitation::ReferenceSettings;

/// The closed loop of `bench control`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControlSettings {
    /// Name of a controller (`fast`, `slow`, ...), or the path of a TOML file with sections.
    pub controller: String,
    /// A loop with a smaller modulus margin (1/max|S|), or an unstable one, is refused; 0 refuses none on the simulated stage. On devices an unstable loop is always refused.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub min_modulus_margin: f64,
    /// Time with zero current before the loop closes, in seconds. The mean position over this time is the rest position; the reference is relative to it.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub settle_s: f64,
    /// Certificate of a chirp (`STEM_certificate.json`), with which the loop closes. On devices a closed loop needs one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub certificate: Option<String>,
    /// Days for which a certificate is valid, from the start of its chirp; written into each new certificate.
    #[serde(default = "default_certificate_valid_days")]
    #[schemars(range(min = 0.0, max = 100000.0))]
    pub certificate_valid_days: f64,
    /// Duration of the run after the loop has closed, in seconds.
    #[schemars(range(min = 0.001, max = 1000000.0))]
    pub duration_s: f64,
    /// Time from the last change of the reference to the beginning of the steady state, in seconds.
    #[schemars(range(min = 0.0, max = 1000000.0))]
    pub steady_after_s: f64,
    /// The reference.
    pub reference: ReferenceSettings,
    /// The shaping of the reference.
    #[serde(default, skip_serializing_if = "ShaperSettings::is_none")]
    pub shaper: ShaperSettings,
    /// The low-pass of the reference.
    #[serde(default, skip_serializing_if = "PrefilterSettings::is_none")]
    pub prefilter: PrefilterSettings,
    /// The feedforward current.
    #[serde(default, skip_serializing_if = "FeedforwardSettings::is_none")]
    pub feedforward: FeedforwardSettings,
}

impl ControlSettings {
    /// Whether the loop has a command beside its reference: shaping, prefilter or feedforward.
    pub fn has_command(&self) -> bool {
        !(self.shaper.is_none() && self.prefilter.is_none() && self.feedforward.is_none())
    }
}

/// Recordings of older versions do not have the setting.
fn default_certificate_valid_days() -> f64 {
    30.0
}
