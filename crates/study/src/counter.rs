//! The number of CNMP pairs of one draw.

use serde_json::Value;

use bench_plant::zeros::{cnmp_pairs, damped_zeros, undamped_zeros};
use bench_plant::{ModalModel, PlantError, PlantSettings, Structure};

/// CNMP pairs of one draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Count {
    /// CNMP pairs of the zeros without damping.
    pub pairs: u32,
    /// CNMP pairs of the zeros with damping, if they are counted.
    pub damped_pairs: Option<u32>,
}

/// A plant with settings that are replaced by their paths.
pub(super) struct Counter<'a> {
    nominal: &'a PlantSettings,
    damped: bool,
    settings: Value,
    pointers: Vec<String>,
}

impl<'a> Counter<'a> {
    /// A counter for values of the settings `keys`.
    pub fn new<'k>(
        nominal: &'a PlantSettings,
        keys: impl Iterator<Item = &'k str>,
        damped: bool,
    ) -> Counter<'a> {
        // A table of numbers and strings can always be converted to JSON.
        let mut settings = serde_json::to_value(nominal).unwrap_or_default();
        if let Some(table) = settings.as_object_mut() {
            table.shift_remove("model");
        }
        Counter {
            nominal,
            damped,
            settings,
            pointers: keys.map(pointer).collect(),
        }
    }

    /// The count of a draw, or the reason why its plant cannot be analysed.
    pub fn count(&mut self, values: &[f64]) -> Result<Count, String> {
        let plant = self.plant(values)?;
        check_relations(&plant)?;
        self.pairs(&plant).map_err(|error| error.to_string())
    }

    fn pairs(&self, plant: &PlantSettings) -> Result<Count, PlantError> {
        if !self.damped {
            return undamped_count(&bench_plant::undamped(plant));
        }
        let structure = bench_plant::build(plant)?;
        let damped_pairs = cnmp_pairs(&damped_zeros(&structure)?) as u32;
        Ok(Count {
            damped_pairs: Some(damped_pairs),
            ..undamped_count(&structure)?
        })
    }

    /// The plant with these values.
    pub fn plant(&mut self, values: &[f64]) -> Result<PlantSettings, String> {
        for (pointer, value) in self.pointers.iter().zip(values) {
            let place = self.settings.pointer_mut(pointer);
            *place.ok_or_else(|| format!("there is no setting at {pointer}"))? =
                Value::from(*value);
        }
        let plant = self.nominal.with_table(&self.settings);
        plant.map_err(|error| error.to_string())
    }
}

/// The JSON pointer of a key below `plant`.
fn pointer(key: &str) -> String {
    key.strip_prefix("plant").unwrap_or(key).replace('.', "/")
}

fn check_relations(plant: &PlantSettings) -> Result<(), String> {
    let findings = plant.check();
    if findings.is_empty() {
        return Ok(());
    }
    let lines = findings
        .iter()
        .map(|finding| format!("\n  `{}` {}", finding.path, finding.what));
    Err(format!(
        "the plant is refused:{}",
        lines.collect::<String>()
    ))
}

/// The modes are computed first: a plant that cannot move, is not held or does not respond has no zeros to count.
fn undamped_count(structure: &Structure) -> Result<Count, PlantError> {
    ModalModel::of(structure)?;
    Ok(Count {
        pairs: cnmp_pairs(&undamped_zeros(structure)?) as u32,
        damped_pairs: None,
    })
}
