//! One setting that varies over a grid.

use super::super::error::CliError;
use super::super::options::BenchOptions;
use crate::config::{Config, Purpose};
use crate::model::plant::{self, Structure};
use crate::util::quantity::{self, Quantity};

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
    /// The grid. A value in per cent is one of the beam length where the setting is a length.
    pub fn values(&self) -> Result<Vec<f64>, CliError> {
        self.refuse_options()?;
        let config = self.bench.load(Purpose::Model, &[])?;
        let (from, to) = (
            self.number(&config, self.from)?,
            self.number(&config, self.to)?,
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
        self.number(&self.bench.load(Purpose::Model, &[])?, text)
    }

    /// The plant at a value.
    pub fn at(&self, value: f64) -> Result<Structure, CliError> {
        Ok(plant::build(&self.config(value)?.plant)?)
    }

    /// The configuration at a value.
    pub fn config(&self, value: f64) -> Result<Config, CliError> {
        self.bench
            .load(Purpose::Model, &[format!("{}={value:?}", self.vary)])
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

    fn number(&self, config: &Config, text: &str) -> Result<f64, CliError> {
        match quantity::parse(text).map_err(|e| CliError::Usage(e.to_string()))? {
            Quantity::Ratio(ratio) if self.vary.ends_with("_m") => {
                Ok(ratio * beam_length_m(config, self.vary)?)
            }
            Quantity::Bare(value) | Quantity::Metres(value) | Quantity::Ratio(value) => Ok(value),
        }
    }
}

fn beam_length_m(config: &Config, key: &str) -> Result<f64, CliError> {
    let plant = serde_json::to_value(&config.plant).unwrap_or_default();
    let length_m = plant
        .get("beam_length_m")
        .and_then(serde_json::Value::as_f64);
    length_m.ok_or_else(|| {
        CliError::Usage(format!(
            "this plant has no beams: give {key} in metres, not in per cent"
        ))
    })
}
