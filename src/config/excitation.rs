//! How the stage is excited, beside the chirp: its band, quiet, fades and amplitude over frequency are everyone's.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Which excitation `bench chirp` uses. Band, quiet before and after, fades and amplitude over frequency stand in `[chirp]`
/// for all kinds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ExcitationSettings {
    /// Which kind.
    pub kind: ExcitationKind,
}

/// The kinds of excitation.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema, clap::ValueEnum,
)]
#[serde(rename_all = "snake_case")]
#[value(rename_all = "snake_case")]
pub enum ExcitationKind {
    /// A sine of rising or falling frequency, `[chirp]`.
    Chirp,
    /// Many sines at once, periodic, `[multisine]`.
    Multisine,
    /// One sine after the other, `[stepped_sine]`.
    SteppedSine,
    /// A pseudo-random binary sequence, periodic, `[prbs]`.
    Prbs,
}

/// A random-phase multisine. Amplitudes over its lines have the shape of `chirp.amplitude`, whose largest value within the
/// band is the largest current of the sum.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MultisineSettings {
    /// Length of a period in seconds, rounded to ticks: lines stand at multiples of one over it.
    #[schemars(range(min = 0.01, max = 1000.0))]
    pub period_s: f64,
    /// Periods that are measured; the last shows the drift of the one before it.
    #[schemars(range(min = 5, max = 100000))]
    pub periods: u32,
    /// Periods before them, in which it fades in and the stage settles.
    #[schemars(range(min = 1, max = 1000))]
    pub settle_periods: u32,
    /// Which lines are excited.
    pub lines: Lines,
    /// Seed of the phases, and of the lines left out.
    #[schemars(range(min = 0, max = 9223372036854775807i64))]
    pub seed: u64,
}

/// Which lines of a multisine are excited.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Lines {
    /// All of the band.
    Full,
    /// The odd ones: even distortion falls between them.
    Odd,
    /// The odd ones but one in four, drawn at random in each group: odd distortion shows there.
    OddRandom,
}

/// Sines one after the other, each settled and then measured over whole periods.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SteppedSineSettings {
    /// How many frequencies, from `chirp.start_hz` to `chirp.stop_hz`.
    #[schemars(range(min = 2, max = 10000))]
    pub count: u32,
    /// How they are spaced.
    pub spacing: Spacing,
    /// Time in seconds for which each sine runs before it is measured; over the first half it takes the place of the one
    /// before.
    #[schemars(range(min = 0.001, max = 1000.0))]
    pub settle_s: f64,
    /// Least time in seconds for which each is measured: six blocks of whole periods, the last of which shows the drift.
    #[schemars(range(min = 0.001, max = 10000.0))]
    pub measure_s: f64,
}

/// Blocks in which a sine is measured: five that are averaged, and one that shows the drift.
pub(crate) const BLOCKS_PER_SINE: f64 = 6.0;

impl SteppedSineSettings {
    /// The frequencies asked for in hertz; what fits whole ticks is next to them.
    pub fn frequencies_hz(&self, start_hz: f64, stop_hz: f64) -> Vec<f64> {
        let last = f64::from(self.count.max(2) - 1);
        let at = |share: f64| match self.spacing {
            Spacing::Linear => start_hz + (stop_hz - start_hz) * share,
            Spacing::Logarithmic => start_hz * libm::pow(stop_hz / start_hz, share),
        };
        (0..self.count.max(2))
            .map(|k| at(f64::from(k) / last))
            .collect()
    }
}

/// How frequencies are spaced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Spacing {
    /// At equal differences.
    Linear,
    /// At equal ratios.
    Logarithmic,
}

/// A maximum-length sequence of plus and minus one amplitude.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PrbsSettings {
    /// Cells n of the shift register: 2^n - 1 steps a period.
    #[schemars(range(min = 7, max = 20))]
    pub order: u32,
    /// Ticks a step.
    #[schemars(range(min = 1, max = 1000))]
    pub clock_divider: u32,
    /// Current in amperes, to both sides.
    #[schemars(range(min = 1e-9, max = 1000.0))]
    pub amplitude_a: f64,
    /// Periods that are measured; the last shows the drift of the one before it.
    #[schemars(range(min = 5, max = 100000))]
    pub periods: u32,
    /// Periods before them, in which it fades in and the stage settles.
    #[schemars(range(min = 1, max = 1000))]
    pub settle_periods: u32,
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
