//! How the frequency response is estimated.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the frequency response is estimated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum IdentifySettings {
    /// Local models, fitted to neighbouring frequencies of the transform of the whole record. There is no leakage if the record
    /// begins and ends at rest.
    Local(EstimatorSettings),
    /// Averages over segments of time (Welch), with Hann windows and an overlap of one half.
    Welch {
        /// Duration of a segment in seconds.
        #[schemars(range(min = 0.001, max = 100000.0))]
        segment_s: f64,
        /// The signal with noise.
        #[serde(default)]
        estimator: Estimator,
    },
}

/// The local estimator: resolution, frequencies, and local model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EstimatorSettings {
    /// Half-width of the neighbourhood of a frequency, as a ratio of the frequency.
    #[schemars(range(min = 0.0, max = 0.1))]
    pub resolution_ratio: f64,
    /// Smallest half-width in bins of the record's transform.
    #[schemars(range(min = 2, max = 10000))]
    pub min_half_width_bins: usize,
    /// Half-width over frequency, instead of the ratio, in rising order: straight lines on logarithmic axes, constant outside.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 64))]
    pub resolution: Vec<ResolutionPoint>,
    /// Number of frequencies, evenly spaced on a logarithmic axis; if absent, their distance is half of the half-width.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 2, max = 1000000))]
    pub frequencies: Option<usize>,
    /// The model of the response within a neighbourhood.
    #[serde(default)]
    pub curve: LocalModel,
    /// The signal with noise.
    #[serde(default)]
    pub estimator: Estimator,
    /// Whether the record begins or ends in motion: the transient in the transform is then estimated together with the response.
    #[serde(default)]
    pub transient: bool,
}

impl Default for EstimatorSettings {
    fn default() -> Self {
        Self {
            resolution_ratio: 0.0025,
            min_half_width_bins: 16,
            resolution: Vec::new(),
            frequencies: None,
            curve: LocalModel::default(),
            estimator: Estimator::default(),
            transient: false,
        }
    }
}

impl IdentifySettings {
    /// The settings of the local estimator; its defaults if another one is selected.
    pub fn local(&self) -> EstimatorSettings {
        match self {
            IdentifySettings::Local(settings) => settings.clone(),
            IdentifySettings::Welch { .. } => EstimatorSettings::default(),
        }
    }
}

/// The resolution of an estimate at a frequency.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ResolutionPoint {
    /// Frequency in hertz, rising from point to point.
    #[schemars(range(min = 1e-4, max = 1e5))]
    pub frequency_hz: f64,
    /// Half-width of the neighbourhood there, in hertz.
    #[schemars(range(min = 1e-6, max = 1e4))]
    pub half_width_hz: f64,
}

/// The model of the response within a neighbourhood of frequencies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LocalModel {
    /// A constant, the weighted mean. The bias grows with the square of the half-width.
    Constant,
    /// A parabola. The bias grows with the fourth power of the half-width.
    Polynomial,
    /// A parabola divided by a straight line, which is a pole, if the data require one; otherwise a parabola.
    #[default]
    Rational,
}

/// The signal with noise, which decides which estimate of H has no bias.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Estimator {
    /// The output. This is the case on a bench, where the command is known exactly.
    #[default]
    H1,
    /// The input.
    H2,
    /// Both signals, with the same ratio of noise to signal: the geometric mean of H1 and H2.
    Hv,
}
