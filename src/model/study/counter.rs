//! From what a draw gave the settings to the number of CNMP pairs.

use serde::Deserialize;
use serde_json::Value;

use super::{Count, Plan};
use crate::config::{
    LumpedSettings, ModalSettings, PlantSettings, Sr4dofSettings, XySettings, check_plant_relations,
};
use crate::model::plant::{self, ModalModel, PlantError, Structure};
use crate::model::zeros::{cnmp_pairs, damped_zeros, undamped_zeros};

/// A plant whose settings can be put in by their paths.
pub(super) struct Counter<'a> {
    plan: &'a Plan,
    settings: Value,
    pointers: Vec<String>,
}

impl<'a> Counter<'a> {
    pub fn new(plan: &'a Plan) -> Counter<'a> {
        // A table of plain numbers and words is always JSON.
        let mut settings = serde_json::to_value(&plan.plant).unwrap_or_default();
        if let Some(table) = settings.as_object_mut() {
            table.shift_remove("model");
        }
        let pointer = |key: &str| key.strip_prefix("plant").unwrap_or(key).replace('.', "/");
        Counter {
            plan,
            settings,
            pointers: plan.varied.iter().map(|one| pointer(&one.key)).collect(),
        }
    }

    /// The count of a draw; or why its plant cannot be analysed.
    pub fn count(&mut self, values: &[f64]) -> Result<Count, String> {
        let plant = self.plant(values)?;
        check_plant_relations(&plant).map_err(|error| error.to_string())?;
        self.pairs(&plant).map_err(|error| error.to_string())
    }

    fn pairs(&self, plant: &PlantSettings) -> Result<Count, PlantError> {
        if self.plan.damped {
            let structure = plant::build(plant)?;
            let damped_pairs = Some(cnmp_pairs(&damped_zeros(&structure)?) as u32);
            return Ok(Count {
                damped_pairs,
                ..undamped(&structure)?
            });
        }
        undamped(&plant::undamped(plant))
    }

    /// The plant with these values.
    pub fn plant(&mut self, values: &[f64]) -> Result<PlantSettings, String> {
        for (pointer, value) in self.pointers.iter().zip(values) {
            let place = self
                .settings
                .pointer_mut(pointer)
                .ok_or_else(|| format!("there is no setting at {pointer}"))?;
            *place = Value::from(*value);
        }
        let settings = &self.settings;
        // The table of the model itself: one of several would be read by way of a copy, six times slower.
        let plant = match self.plan.plant {
            PlantSettings::Sr4dof(_) => {
                Sr4dofSettings::deserialize(settings).map(PlantSettings::Sr4dof)
            }
            PlantSettings::Xy(_) => XySettings::deserialize(settings).map(PlantSettings::Xy),
            PlantSettings::Lumped(_) => {
                LumpedSettings::deserialize(settings).map(PlantSettings::Lumped)
            }
            PlantSettings::Modal(_) => {
                ModalSettings::deserialize(settings).map(PlantSettings::Modal)
            }
        };
        plant.map_err(|error| error.to_string())
    }
}

/// The modes are asked first: what cannot move, is not held or does not respond has no zeros to count.
fn undamped(structure: &Structure) -> Result<Count, PlantError> {
    ModalModel::of(structure)?;
    Ok(Count {
        pairs: cnmp_pairs(&undamped_zeros(structure)?) as u32,
        damped_pairs: None,
    })
}
