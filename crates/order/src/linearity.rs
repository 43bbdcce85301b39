//! The order of a series of amplitudes.

use std::ops::RangeInclusive;

use schemars::JsonSchema;
use serde::Serialize;

use super::bench_options::BenchOptions;
use super::excitation_options::ExcitationOptions;
use super::figure_options::ResponseFigureOptions;
use super::rig_options::RigOptions;
use bench_base::quantity::Ratio;
use bench_config::{Config, OptionSetting, Purpose};
use bench_experiment::ExperimentError;

/// Odd lines, one of each group of four omitted.
const LINES: [(&str, &str); 2] = [
    ("excitation.kind", "multisine"),
    ("multisine.lines", "odd_random"),
];
/// Largest number of amplitudes.
const MAX_AMPLITUDES: usize = 10;
/// Allowed ratios of the planned amplitude.
const SCALES: RangeInclusive<f64> = 1e-6..=1e6;

/// The bench, and the amplitudes.
#[derive(Clone, Debug, PartialEq, clap::Args, Serialize, JsonSchema)]
pub struct LinearityOrder {
    /// The bench.
    #[command(flatten)]
    #[serde(flatten)]
    pub bench: BenchOptions,
    /// Rig and pace.
    #[command(flatten)]
    #[serde(flatten)]
    pub rig: RigOptions,
    /// Band and amplitude.
    #[command(flatten)]
    #[serde(flatten)]
    pub band: ExcitationOptions,
    /// How responses are drawn.
    #[command(flatten)]
    #[serde(flatten)]
    pub figures: ResponseFigureOptions,
    /// Amplitudes as ratios of the planned amplitude; one run for each ratio
    #[arg(
        long,
        value_name = "RATIO,RATIO,...",
        value_delimiter = ',',
        default_value = "0.25,0.5,1",
        allow_hyphen_values = true
    )]
    pub scales: Vec<Ratio>,
}

impl LinearityOrder {
    /// The ratios, rising.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn amplitude_ratios(&self) -> Result<Vec<f64>, ExperimentError> {
        let mut scales: Vec<f64> = self.scales.iter().map(Ratio::si).collect();
        scales.sort_by(f64::total_cmp);
        if are_amplitudes(&scales) {
            Ok(scales)
        } else {
            Err(ExperimentError::Refused(format!(
                "--scales {scales:?} is not a list of amplitudes; give two to {MAX_AMPLITUDES} different ratios from 0.000001 to 1000000, for example 0.5,1,2"
            )))
        }
    }

    /// The settings with the planned amplitude.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn planned(&self) -> Result<Config, ExperimentError> {
        let lines = LINES.map(|(key, value)| OptionSetting::new(key, value, "bench linearity"));
        let mut settings = [&lines[..], &self.band.settings()].concat();
        settings.extend(self.rig.seed.setting());
        let config = self.bench.load(Purpose::Chirp, &settings)?;
        self.band.shaped(config)
    }
}

/// Whether sorted ratios are different, allowed, and of an allowed number.
fn are_amplitudes(scales: &[f64]) -> bool {
    let are_allowed = scales.iter().all(|scale| SCALES.contains(scale));
    let are_rising = scales.windows(2).all(|pair| pair[0] < pair[1]);
    are_allowed && are_rising && (2..=MAX_AMPLITUDES).contains(&scales.len())
}
