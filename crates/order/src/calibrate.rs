//! The order of a calibration.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;

use super::bench_options::{BenchOptions, given};
use super::help::with_setting;
use super::path_text::optional_path_text;
use super::rig_options::RigOptions;
use bench_base::quantity::Current;
use bench_config::{Config, OptionSetting, Purpose};
use bench_experiment::{ExperimentError, calibration};

/// The bench, and how it is calibrated.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, JsonSchema)]
pub struct CalibrateOrder {
    /// The bench.
    #[command(flatten)]
    #[serde(flatten)]
    pub bench: BenchOptions,
    /// Rig and pace.
    #[command(flatten)]
    #[serde(flatten)]
    pub rig: RigOptions,
    /// Largest current, in both directions
    #[arg(long, value_name = "CURRENT", allow_hyphen_values = true,
        help = with_setting("Largest current, in both directions", "calibrate.amplitude_a"))]
    pub amplitude: Option<Current>,
    /// Calibration file to write [default: in the folder of the recording, with the same name]
    #[arg(long, value_name = "FILE")]
    #[serde(serialize_with = "optional_path_text")]
    pub write: Option<PathBuf>,
    /// Do not measure the delay by a chirp
    #[arg(long)]
    pub no_delay: bool,
}

impl CalibrateOrder {
    /// The configuration of the calibration.
    ///
    /// # Errors
    /// When it is refused.
    pub fn config(&self) -> Result<Config, ExperimentError> {
        let amplitude = self.amplitude.as_ref();
        let amplitude = given("calibrate.amplitude_a", "--amplitude", amplitude);
        let seed = self.rig.seed.setting();
        let settings: Vec<OptionSetting> = amplitude.into_iter().chain(seed).collect();
        let config = self.bench.load(Purpose::Chirp, &settings)?;
        Ok(calibration::settings(config))
    }
}
