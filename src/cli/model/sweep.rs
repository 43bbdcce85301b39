//! One setting that varies over a grid.

use super::super::error::CliError;
use super::super::options::BenchOptions;
use crate::config::{Config, OptionSetting, Purpose};
use crate::model::plant::{self, Structure};
use crate::util::quantity::{Quantity, QuantityError};

/// `count` values of the setting `vary`, two or more.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sweep<'a> {
    pub bench: &'a BenchOptions,
    pub vary: &'a str,
    pub from: &'a str,
    pub to: &'a str,
    pub count: u32,
}

impl Sweep<'_> {
    /// The grid.
    pub fn values(&self) -> Result<Vec<f64>, CliError> {
        self.refuse_options()?;
        let config = self.bench.load(Purpose::Model, &[])?;
        let (from, to) = (
            self.number(&config, "--from", self.from)?,
            self.number(&config, "--to", self.to)?,
        );
        if from == to {
            return Err(CliError::Usage(format!(
                "an empty sweep: --from and --to are both {from}; give two values"
            )));
        }
        let last = f64::from(self.count - 1);
        let value = |k: u32| {
            if k + 1 == self.count {
                to
            } else {
                from + (to - from) * f64::from(k) / last
            }
        };
        Ok((0..self.count).map(value).collect())
    }

    /// A value as typed, read as those of the range are.
    pub fn value(&self, text: &str) -> Result<f64, CliError> {
        self.number(&self.bench.load(Purpose::Model, &[])?, "--at", text)
    }

    /// The plant at a value.
    pub fn at(&self, value: f64) -> Result<Structure, CliError> {
        Ok(plant::build(&self.config(value)?.plant)?)
    }

    /// The configuration at a value.
    pub fn config(&self, value: f64) -> Result<Config, CliError> {
        let option = format!("--vary {}", self.vary);
        let setting = OptionSetting::new(self.vary, value, option);
        self.bench.load(Purpose::Model, &[setting])
    }

    fn refuse_options(&self) -> Result<(), CliError> {
        let option = (self.vary == "plant.operating_point_m"
            && self.bench.operating_point.is_some())
            || (self.vary == "plant.mass_asymmetry" && self.bench.asymmetry.is_some());
        match option {
            true => Err(CliError::Usage(format!(
                "--vary {} and an option that fixes it: leave out the option",
                self.vary
            ))),
            false => Ok(()),
        }
    }

    fn number(&self, config: &Config, option: &str, text: &str) -> Result<f64, CliError> {
        let beam_length_m = config.plant.beam_length_m();
        let quantity: Result<Quantity, QuantityError> = text.parse();
        let value = quantity.and_then(|value| value.for_setting(self.vary, beam_length_m));
        value.map_err(|error| CliError::Usage(format!("{option} {text}: {error}")))
    }
}
