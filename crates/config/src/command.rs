//! The command of a closed loop: shaping, prefilter and feedforward.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use bench_excitation::command::Vibration;

/// The shaping of the reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum ShaperSettings {
    /// None.
    #[default]
    None,
    /// Zero vibration: two impulses for each mode.
    Zv(ImpulseShaperSettings),
    /// Zero vibration and derivative: three impulses for each mode.
    Zvd(ImpulseShaperSettings),
    /// Extra insensitive: three impulses for each mode, with a permitted residual vibration.
    Ei(InsensitiveShaperSettings),
    /// The fastest step with bounded current and travel, for a range of plants. Only for a step.
    MinimumTime(MinimumTimeSettings),
}

impl ShaperSettings {
    /// The name as in `control.shaper.kind`.
    pub fn name(&self) -> &'static str {
        match self {
            ShaperSettings::None => "none",
            ShaperSettings::Zv(_) => "zv",
            ShaperSettings::Zvd(_) => "zvd",
            ShaperSettings::Ei(_) => "ei",
            ShaperSettings::MinimumTime(_) => "minimum_time",
        }
    }

    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        *self == ShaperSettings::None
    }
}

/// Settings of a ZV or ZVD shaper.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ImpulseShaperSettings {
    /// Modes whose vibration is cancelled; empty for those lightly damped modes of the closed loop that answer a step with at least
    /// 1 % of its height.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 6))]
    pub modes: Vec<VibrationSettings>,
}

/// Settings of an EI shaper.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InsensitiveShaperSettings {
    /// Modes whose vibration is reduced; empty for those lightly damped modes of the closed loop that answer a step with at least
    /// 1 % of its height.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 6))]
    pub modes: Vec<VibrationSettings>,
    /// Permitted residual vibration at the frequency of a mode, as a ratio of that without a shaper.
    #[serde(default = "default_vibration_ratio")]
    #[schemars(range(min = 0.001, max = 0.5))]
    pub vibration_ratio: f64,
}

fn default_vibration_ratio() -> f64 {
    0.05
}

/// A mode of vibration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct VibrationSettings {
    /// Natural frequency in hertz.
    #[schemars(range(min = 0.01, max = 1e5))]
    pub frequency_hz: f64,
    /// Damping ratio.
    #[schemars(range(min = 0.0, max = 0.9))]
    pub damping_ratio: f64,
}

impl From<&VibrationSettings> for Vibration {
    fn from(settings: &VibrationSettings) -> Vibration {
        Vibration {
            omega_rad_s: std::f64::consts::TAU * settings.frequency_hz,
            damping_ratio: settings.damping_ratio,
        }
    }
}

/// Settings of the fastest step. The planned plants are those of the model at each operating point, with the frequencies of its
/// modes lower, equal and higher by the tolerance, and the modes of `sim.unmodelled`; and the model alone.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MinimumTimeSettings {
    /// Operating points in metres for which the step is planned; empty for `plant.operating_point_m` alone. One step is planned for
    /// all of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    #[schemars(length(max = 32), inner(range(min = -1.0, max = 1.0)))]
    pub operating_points_m: Vec<f64>,
    /// Tolerance of the frequencies of the modelled modes, as a ratio.
    #[serde(default = "default_frequency_tolerance_ratio")]
    #[schemars(range(min = 0.0, max = 0.2))]
    pub frequency_tolerance_ratio: f64,
    /// Largest overshoot as a ratio of the step; absent if only the limits of travel apply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 1.0))]
    pub max_overshoot_ratio: Option<f64>,
    /// Part of the settling band of 2 % of the step, and of the overshoot, that is left free for noise and disturbances, in metres.
    #[serde(default = "default_margin_m")]
    #[schemars(range(min = 0.0, max = 0.001))]
    pub margin_m: f64,
    /// Largest planned current as a ratio of the limit of amplifier or motor; the rest is for the answer of the controller to noise.
    #[serde(default = "default_current_ratio")]
    #[schemars(range(min = 0.01, max = 1.0))]
    pub current_ratio: f64,
    /// Length of the blocks of constant reference in seconds.
    #[serde(default = "default_block_s")]
    #[schemars(range(min = 1e-5, max = 1.0))]
    pub block_s: f64,
    /// Time over which the reference changes, in seconds; the step settles within it.
    #[serde(default = "default_longest_s")]
    #[schemars(range(min = 1e-4, max = 10.0))]
    pub longest_s: f64,
}

impl Default for MinimumTimeSettings {
    fn default() -> MinimumTimeSettings {
        MinimumTimeSettings {
            operating_points_m: Vec::new(),
            frequency_tolerance_ratio: default_frequency_tolerance_ratio(),
            max_overshoot_ratio: None,
            margin_m: default_margin_m(),
            current_ratio: default_current_ratio(),
            block_s: default_block_s(),
            longest_s: default_longest_s(),
        }
    }
}

/// Wire cutting and clamping shift the modes of the stage by up to 1 %.
fn default_frequency_tolerance_ratio() -> f64 {
    0.01
}

/// Four standard deviations of the position of the stage in its steady state, 0.05 um.
fn default_margin_m() -> f64 {
    2e-7
}

fn default_current_ratio() -> f64 {
    0.95
}

fn default_block_s() -> f64 {
    0.001
}

fn default_longest_s() -> f64 {
    0.08
}

/// The low-pass of the reference.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum PrefilterSettings {
    /// None.
    #[default]
    None,
    /// Critically damped, of second order.
    LowPass(LowPassSettings),
}

impl PrefilterSettings {
    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        *self == PrefilterSettings::None
    }
}

/// Settings of the low-pass.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LowPassSettings {
    /// Frequency of both poles in hertz.
    #[schemars(range(min = 0.01, max = 1e5))]
    pub frequency_hz: f64,
}

/// The feedforward current.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum FeedforwardSettings {
    /// None.
    #[default]
    None,
    /// By the stable inverse of the model, with preview.
    Inverse(InverseSettings),
}

impl FeedforwardSettings {
    /// Whether there is none.
    pub fn is_none(&self) -> bool {
        *self == FeedforwardSettings::None
    }
}

/// Settings of the inverse.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InverseSettings {
    /// Highest frequency in hertz that the reference keeps; from twice this frequency on it is attenuated by 60 dB. The preview is
    /// 1.8 periods of this frequency, and more where the zeros of the plant need it.
    #[serde(default = "default_bandwidth_hz")]
    #[schemars(range(min = 0.01, max = 1e5))]
    pub bandwidth_hz: f64,
}

fn default_bandwidth_hz() -> f64 {
    25.0
}

impl Default for InverseSettings {
    fn default() -> InverseSettings {
        InverseSettings {
            bandwidth_hz: default_bandwidth_hz(),
        }
    }
}
