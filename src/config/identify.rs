//! How the frequency response is estimated.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the frequency response is estimated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum IdentifySettings {
    /// By smooth curves through neighbouring frequencies of the transform of the whole record: no leakage where it begins and
    /// ends at rest.
    Local(EstimatorSettings),
    /// Over segments in time (Welch): Hann windows, half overlapped.
    Welch {
        /// Length of a segment in seconds.
        #[schemars(range(min = 0.001, max = 100000.0))]
        segment_s: f64,
        /// Which signal has noise.
        #[serde(default)]
        estimator: Estimator,
    },
}

/// The local estimator: resolution, grid, and shape of the curves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct EstimatorSettings {
    /// Half-width of the neighbourhood of a frequency, as a ratio of the frequency.
    #[schemars(range(min = 0.0, max = 0.1))]
    pub resolution_ratio: f64,
    /// Smallest half-width in bins of the record's transform.
    #[schemars(range(min = 2, max = 10000))]
    pub min_half_width_bins: usize,
    /// Half-width over frequency in place of the ratio, in rising order: straight lines on logarithmic axes, constant outside.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 64))]
    pub resolution: Vec<ResolutionPoint>,
    /// So many frequencies, evenly on a logarithmic axis; without it they are half of a half-width apart.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 2, max = 1000000))]
    pub frequencies: Option<usize>,
    /// The shape of the response within a neighbourhood.
    #[serde(default)]
    pub curve: LocalModel,
    /// Which signal has noise.
    #[serde(default)]
    pub estimator: Estimator,
    /// Whether the record begins or ends in motion: what that leaves in the transform is then estimated with the response.
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

/// What shape a response is given within a neighbourhood of frequencies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum LocalModel {
    /// A constant: the weighted mean. Its bias grows with the square of the half-width.
    Constant,
    /// A parabola: bias of the fourth power.
    Polynomial,
    /// A parabola over a straight line, a pole, where the data call for one; else a parabola.
    #[default]
    Rational,
}

/// Which signal has noise, and so which estimate of H is without bias.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Estimator {
    /// The output: what a bench has, whose command is known exactly.
    #[default]
    H1,
    /// The input.
    H2,
    /// Both, in the same ratio to the signal: the geometric mean of H1 and H2.
    Hv,
}
