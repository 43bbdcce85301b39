//! The options that all commands on a bench share.

use clap::Args;

use super::error::CliError;
use crate::config::{Config, PlantSettings, Purpose, Source, load};
use crate::rig::devices;
use crate::util::quantity::{self, Quantity};

/// Which bench.
#[derive(Clone, Debug, Default, Args)]
pub(super) struct BenchOptions {
    /// A TOML file, or a profile by name
    #[arg(long, value_name = "FILE|NAME")]
    pub config: Option<String>,
    /// Override one setting, repeatable: --set plant.mass_asymmetry=0.05
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Static Y displacement of the motion stage: 8% of the beam length, 3.8mm, or metres
    #[arg(long, value_name = "Y", allow_hyphen_values = true)]
    pub operating_point: Option<String>,
    /// Mass asymmetry m2/m3 - 1: 10% or 0.1
    #[arg(long, value_name = "D", allow_hyphen_values = true)]
    pub asymmetry: Option<String>,
    /// Seed of noise and disturbance
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    pub seed: Option<u64>,
    /// One JSON object on standard output, nothing else there
    #[arg(long)]
    pub json: bool,
}

impl BenchOptions {
    /// The profile's name, or the file.
    pub fn profile(&self) -> &str {
        self.config
            .as_deref()
            .unwrap_or(crate::config::profiles::DEFAULT)
    }

    /// The effective configuration; `more` are settings that the command's own options stand for.
    pub fn load(&self, purpose: Purpose, more: &[String]) -> Result<Config, CliError> {
        let mut source = Source {
            config: self.config.clone(),
            sets: self.sets.clone(),
            purpose,
        };
        let usage = |e: quantity::QuantityError| CliError::Usage(e.to_string());
        if let Some(seed) = self.seed {
            source.sets.push(format!("sim.seed={seed}"));
        }
        source.sets.extend_from_slice(more);
        let model = (self.asymmetry.is_some() || self.operating_point.is_some())
            .then(|| load(&source))
            .transpose()?;
        let plant = model.map(|config| config.plant);
        if let (Some(text), Some(plant)) = (&self.asymmetry, &plant) {
            has(plant, plant.mass_asymmetry(), "--asymmetry")?;
            source.sets.push(format!(
                "plant.mass_asymmetry={:?}",
                quantity::ratio(text).map_err(usage)?
            ));
        }
        if let (Some(text), Some(plant)) = (&self.operating_point, &plant) {
            let length_m = has(
                plant,
                plant.operating_point_m().and(plant.beam_length_m()),
                "--operating-point",
            )?;
            let metres = match quantity::parse(text).map_err(usage)? {
                Quantity::Bare(metres) | Quantity::Metres(metres) => metres,
                Quantity::Ratio(ratio) => ratio * length_m,
            };
            source
                .sets
                .push(format!("plant.operating_point_m={metres:?}"));
        }
        let config = load(&source)?;
        devices::check(&config)?;
        Ok(config)
    }
}

/// What an option is about, if the model has it.
fn has(plant: &PlantSettings, value: Option<f64>, option: &str) -> Result<f64, CliError> {
    let model = plant.model();
    let settings = "`bench config show` lists its settings, --set KEY=VALUE changes one";
    value.ok_or_else(|| {
        CliError::Usage(format!(
            "{option} has no meaning for the model `{model}`; {settings}"
        ))
    })
}
