//! One setting that varies over a grid.

use super::super::error::CliError;
use bench_base::numeric::linspace;
use bench_base::quantity::{Quantity, QuantityError};
use bench_config::{Config, OptionSetting, Purpose};
use bench_order::BenchOptions;
use bench_plant::Structure;
use bench_thesis::veering::PairError;

/// The setting that varies, and its values. Defaults and limits differ between the commands: see `mut_arg` there.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct SweepArgs {
    #[command(flatten)]
    pub bench: BenchOptions,
    /// The setting that varies: plant.operating_point_m, plant.mass_asymmetry or any other numeric setting
    #[arg(long, value_name = "KEY")]
    pub vary: String,
    /// First value, with a unit (3.8mm) or in SI units (0.0038); in %, it is relative to the beam length for an operating
    /// point, and 1% is 0.01 for a ratio
    #[arg(long, value_name = "A", allow_hyphen_values = true)]
    from: String,
    /// Last value, in the same notation as --from
    #[arg(long, value_name = "B", allow_hyphen_values = true)]
    to: String,
    /// Number of values of the grid; more values are added where needed
    #[arg(long, value_name = "N", default_value_t = 101, value_parser = clap::value_parser!(u32).range(2..=100_000))]
    count: u32,
}

impl SweepArgs {
    /// The grid.
    pub fn values(&self) -> Result<Vec<f64>, CliError> {
        self.check_fixed()?;
        let config = self.bench.load(Purpose::Model, &[])?;
        let from = self.number(&config, "--from", &self.from)?;
        let to = self.number(&config, "--to", &self.to)?;
        if from == to {
            return Err(CliError::Usage(format!(
                "--from and --to are both {from}; give two different values"
            )));
        }
        Ok(linspace(from, to, self.count as usize).collect())
    }

    /// Parses the value of `option`, in the same notation as --from and --to.
    pub fn value(&self, option: &str, text: &str) -> Result<f64, CliError> {
        self.number(&self.bench.load(Purpose::Model, &[])?, option, text)
    }

    /// The value of the setting in the configuration.
    pub fn configured(&self) -> Result<Option<f64>, CliError> {
        let config = self.bench.load(Purpose::Model, &[])?;
        let config = serde_json::to_value(config).unwrap_or_default();
        let pointer = format!("/{}", self.vary.replace('.', "/"));
        Ok(config.pointer(&pointer).and_then(serde_json::Value::as_f64))
    }

    /// The plant at a value.
    pub fn structure(&self, value: f64) -> Result<Structure, CliError> {
        Ok(bench_plant::build(&self.config(value)?.plant)?)
    }

    /// The configuration at a value.
    pub fn config(&self, value: f64) -> Result<Config, CliError> {
        let option = format!("--vary {}", self.vary);
        let setting = OptionSetting::new(&self.vary, value, option);
        Ok(self.bench.load(Purpose::Model, &[setting])?)
    }

    fn check_fixed(&self) -> Result<(), CliError> {
        let option = match self.vary.as_str() {
            "plant.operating_point_m" if self.bench.operating_point.is_some() => {
                "--operating-point"
            }
            "plant.mass_asymmetry" if self.bench.asymmetry.is_some() => "--asymmetry",
            _ => return Ok(()),
        };
        let vary = &self.vary;
        Err(CliError::Usage(format!(
            "{option} fixes `{vary}`, which --vary is to change; leave out {option}"
        )))
    }

    fn number(&self, config: &Config, option: &str, text: &str) -> Result<f64, CliError> {
        let beam_length_m = config.plant.beam_length_m();
        let quantity: Result<Quantity, QuantityError> = text.parse();
        let value = quantity.and_then(|value| value.for_setting(&self.vary, beam_length_m));
        value.map_err(|error| CliError::Usage(format!("{option} {text}: {error}")))
    }
}

/// A sweep and two close modes.
#[derive(Clone, Debug, clap::Args)]
#[command(mut_arg("vary", |arg| arg.required(false).default_value("plant.operating_point_m").requires_all(["from", "to"])))]
#[command(mut_arg("from", |arg| arg.required(false)))]
#[command(mut_arg("to", |arg| arg.required(false).default_value("15%")))]
pub(super) struct CloseModesArgs {
    #[command(flatten)]
    pub sweep: SweepArgs,
    /// Numbers of the two modes, by rising frequency at the first value [default: the pair with the closest approach]
    #[arg(long, value_name = "I,J", value_delimiter = ',')]
    pub modes: Vec<usize>,
}

impl From<PairError> for CliError {
    fn from(error: PairError) -> CliError {
        CliError::Usage(error.to_string())
    }
}
