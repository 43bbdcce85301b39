//! The options that all commands on a bench share, and the settings that they change.

use schemars::JsonSchema;
use serde::Serialize;

use bench_base::quantity::{Measure, OperatingPoint, Ratio};
use bench_config::{Config, OptionSetting, PlantSettings, Purpose, Source, load, texts_of_set};
use bench_experiment::ExperimentError;
use bench_rig::devices;

/// Which bench.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, JsonSchema)]
pub struct BenchOptions {
    /// A TOML file, or a profile by name
    #[arg(long, value_name = "FILE|NAME")]
    pub config: Option<String>,
    /// Override one setting (repeatable): --set plant.mass_asymmetry=0.05; `bench config show` lists all keys
    #[arg(long = "set", value_name = "KEY=VALUE")]
    #[serde(rename = "set")]
    pub sets: Vec<String>,
    /// Static Y displacement of the motion stage: 3.8mm, a number in metres (0.0038), or in % of the beam length (8%)
    #[arg(long, value_name = "LENGTH", allow_hyphen_values = true)]
    pub operating_point: Option<OperatingPoint>,
    /// Mass asymmetry m2/m3 - 1: 10% or 0.1
    #[arg(long, value_name = "RATIO", allow_hyphen_values = true)]
    pub asymmetry: Option<Ratio>,
    /// Print one JSON object on standard output and nothing else
    #[arg(long)]
    pub json: bool,
}

/// The seed, for commands whose result depends on it.
#[derive(Clone, Debug, Default, PartialEq, clap::Args, Serialize, JsonSchema)]
pub struct SeedOption {
    /// Seed of the random generator (noise and disturbance of the simulated stage)
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(..=i64::MAX as u64))]
    seed: Option<u64>,
}

impl SeedOption {
    /// The setting that the option stands for, if it is given.
    pub fn setting(&self) -> Option<OptionSetting> {
        let seed = self.seed?;
        // The parser of the option allows no larger one.
        let setting = OptionSetting::new("sim.seed", seed as i64, format!("--seed {seed}"));
        Some(setting)
    }

    /// Refuses the option for a run on devices, where it has no effect.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn refuse_on_devices(&self) -> Result<(), ExperimentError> {
        match self.seed {
            None => Ok(()),
            Some(seed) => Err(ExperimentError::Refused(format!(
                "--seed {seed} is for the simulated stage and has no effect on devices; leave it out, or add --simulate"
            ))),
        }
    }
}

impl BenchOptions {
    /// The file of the configuration, and what may be a file in the settings.
    pub fn files(&self) -> Vec<String> {
        let settings = self.sets.iter().flat_map(|set| {
            let last = set.rsplit('=').next().unwrap_or(set);
            let mut texts = vec![set.clone(), last.to_string()];
            texts.extend(texts_of_set(set));
            texts
        });
        let settings = settings.map(|text| without_quotes(&text));
        self.config.iter().cloned().chain(settings).collect()
    }

    /// The profile's name, or the file.
    pub fn profile(&self) -> &str {
        self.config
            .as_deref()
            .unwrap_or(bench_config::profiles::DEFAULT)
    }

    /// The effective configuration; `more` are those of the command's own options.
    ///
    /// # Errors
    /// When an option or a setting is refused.
    pub fn load(
        &self,
        purpose: Purpose,
        more: &[OptionSetting],
    ) -> Result<Config, ExperimentError> {
        let mut source = Source {
            config: self.config.clone(),
            sets: self.sets.clone(),
            options: more.to_vec(),
            purpose,
        };
        if self.asymmetry.is_some() || self.operating_point.is_some() {
            let plant = load(&source)?.plant;
            source.options.extend(self.asymmetry_setting(&plant)?);
            source.options.extend(self.operating_point_setting(&plant)?);
        }
        let config = load(&source)?;
        devices::check(&config)?;
        Ok(config)
    }

    fn asymmetry_setting(
        &self,
        plant: &PlantSettings,
    ) -> Result<Option<OptionSetting>, ExperimentError> {
        if self.asymmetry.is_some() {
            require(plant, plant.mass_asymmetry(), "--asymmetry")?;
        }
        let asymmetry = self.asymmetry.as_ref();
        Ok(given("plant.mass_asymmetry", "--asymmetry", asymmetry))
    }

    fn operating_point_setting(
        &self,
        plant: &PlantSettings,
    ) -> Result<Option<OptionSetting>, ExperimentError> {
        let Some(point) = &self.operating_point else {
            return Ok(None);
        };
        let beam_length_m = plant.operating_point_m().and(plant.beam_length_m());
        require(plant, beam_length_m, "--operating-point")?;
        let point_m = point.metres(beam_length_m);
        let point_m = point_m.map_err(|error| ExperimentError::Refused(error.to_string()))?;
        let option = format!("--operating-point {point}");
        let setting = OptionSetting::new("plant.operating_point_m", point_m, option);
        Ok(Some(setting))
    }
}

/// A text without the quotation marks of TOML.
fn without_quotes(text: &str) -> String {
    text.trim().trim_matches(['"', '\'']).into()
}

/// The setting `key` with the quantity of `option`, if it is given.
pub fn given<D>(key: &str, option: &str, quantity: Option<&Measure<D>>) -> Option<OptionSetting> {
    let quantity = quantity?;
    let option = format!("{option} {quantity}");
    Some(OptionSetting::new(key, quantity.si(), option))
}

/// Refuses an option for a setting that the model does not have.
fn require(plant: &PlantSettings, value: Option<f64>, option: &str) -> Result<(), ExperimentError> {
    let model = plant.model();
    let settings = "see its settings with `bench config show`, and set one with --set KEY=VALUE";
    value.map(drop).ok_or_else(|| {
        ExperimentError::Refused(format!(
            "{option} is not a setting of the model `{model}`; {settings}"
        ))
    })
}
