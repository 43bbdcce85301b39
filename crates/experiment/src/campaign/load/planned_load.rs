//! The weight and the masses that an operator adds to the stage for a point of the grid.

use serde::{Deserialize, Serialize};

use crate::campaign::error::CampaignError;
use crate::campaign::grid::{MASS_STEP_KG, stage_settings};
use bench_config::{CampaignSettings, Config, PlantSettings, Sr4dofSettings};

/// Standard gravity in m/s^2.
const GRAVITY_M_PER_S2: f64 = 9.80665;
/// A mass below this is treated as zero, in kilograms: half of a mass step.
const NEGLIGIBLE_KG: f64 = MASS_STEP_KG / 2.0;

/// Masses that are added to the stage as it was built, in kilograms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Weight on the virtual pulley (section 5.1.3). A positive one pulls in +Y, a negative one in -Y.
    pub hung_kg: f64,
    /// Added to secondary stage 2.
    pub on_m2_kg: f64,
    /// Added to secondary stage 3.
    pub on_m3_kg: f64,
}

/// The model of a stage that is loaded, with the settings of pulley, tolerances and asymmetry as built.
#[derive(Clone, Copy, Debug)]
pub struct StageModel<'a> {
    /// The stage at its operating point and asymmetry.
    pub stage: &'a Sr4dofSettings,
    /// How the stage is loaded and checked.
    pub settings: &'a CampaignSettings,
}

impl<'a> StageModel<'a> {
    /// The stage of a configuration. Refuses a model without operating point and mass asymmetry.
    pub fn of(config: &'a Config) -> Result<StageModel<'a>, CampaignError> {
        Ok(StageModel {
            stage: stage_settings(config)?,
            settings: &config.campaign,
        })
    }

    /// The load that gives the stage its operating point and asymmetry.
    ///
    /// The weight is F/(g p) with the force F that holds the operating point ([`Sr4dofSettings::holding_force_n`]) and p of `pulley_ratio`.
    /// The masses change the asymmetry B of the stage as it was built, m2 = m3 (1 + B), into D: m3 (D - B) on stage 2, or,
    /// for D < B, m3 ((1 + B)/(1 + D) - 1) on stage 3, to the nearest step of 0.5 g (section 5.2.1).
    pub fn required_load(&self) -> Load {
        let wanted = 1.0 + self.stage.mass_asymmetry;
        let built = 1.0 + self.settings.built_asymmetry;
        let newtons_per_kg = GRAVITY_M_PER_S2 * self.settings.pulley_ratio;
        Load {
            hung_kg: self.stage.holding_force_n() / newtons_per_kg,
            on_m2_kg: self.in_steps(wanted - built),
            on_m3_kg: self.in_steps(built / wanted - 1.0),
        }
    }

    /// A positive ratio of m3 as whole mass steps.
    fn in_steps(&self, ratio: f64) -> f64 {
        let mass_kg = ratio.max(0.0) * self.stage.secondary_stage_mass_kg;
        MASS_STEP_KG * libm::round(mass_kg / MASS_STEP_KG)
    }

    /// The force in newtons with which the weight pulls.
    pub fn force_n(&self, load: &Load) -> f64 {
        load.hung_kg * GRAVITY_M_PER_S2 * self.settings.pulley_ratio
    }

    /// The model of the stage under a load. A mass on stage 3 also increases the mass of the secondary stages.
    pub fn loaded(&self, load: &Load) -> Sr4dofSettings {
        let built_kg = self.stage.secondary_stage_mass_kg;
        let m2_kg = built_kg * (1.0 + self.settings.built_asymmetry) + load.on_m2_kg;
        let m3_kg = built_kg + load.on_m3_kg;
        let at_one_metre = Sr4dofSettings {
            operating_point_m: 1.0,
            ..self.stage.clone()
        };
        Sr4dofSettings {
            secondary_stage_mass_kg: m3_kg,
            mass_asymmetry: m2_kg / m3_kg - 1.0,
            operating_point_m: self.force_n(load) / at_one_metre.holding_force_n(),
            ..self.stage.clone()
        }
    }

    /// The model of [`StageModel::loaded`] as settings of a plant.
    pub fn loaded_plant(&self, load: &Load) -> PlantSettings {
        PlantSettings::Sr4dof(self.loaded(load))
    }
}

impl Load {
    /// The load without a change: one line for the weight and one for each stage.
    pub fn totals(&self) -> [String; 3] {
        [
            total(
                weight_name(self.hung_kg < 0.0),
                self.hung_kg.abs(),
                Unit::Kilogram,
            ),
            total("on stage 2", self.on_m2_kg, Unit::Gram),
            total("on stage 3", self.on_m3_kg, Unit::Gram),
        ]
    }

    /// Instructions to change the load from `before`: one line for the weight and one for each stage.
    pub fn instructions(&self, before: &Load) -> [String; 3] {
        [
            self.weight_instruction(before),
            instruction("on stage 2", self.on_m2_kg, before.on_m2_kg, Unit::Gram),
            instruction("on stage 3", self.on_m3_kg, before.on_m3_kg, Unit::Gram),
        ]
    }

    fn weight_instruction(&self, before: &Load) -> String {
        // If no weight is needed, the side is that of the weight to remove.
        let is_down = self.hung_kg < 0.0 || self.hung_kg == 0.0 && before.hung_kg < 0.0;
        let name = weight_name(is_down);
        let (now_kg, before_kg) = (self.hung_kg.abs(), before.hung_kg.abs());
        if self.hung_kg * before.hung_kg < 0.0 {
            let line = instruction(name, now_kg, 0.0, Unit::Kilogram);
            return format!("remove the weight from the other side; {line}");
        }
        instruction(name, now_kg, before_kg, Unit::Kilogram)
    }
}

fn weight_name(is_down: bool) -> &'static str {
    if is_down {
        "weight in -Y"
    } else {
        "weight in +Y"
    }
}

#[derive(Clone, Copy)]
enum Unit {
    Kilogram,
    Gram,
}

impl Unit {
    fn amount(self, kg: f64) -> String {
        match self {
            Unit::Kilogram => format!("{kg:.3} kg"),
            Unit::Gram => format!("{:.1} g", 1e3 * kg),
        }
    }
}

/// The total mass and its change.
fn instruction(name: &str, now_kg: f64, before_kg: f64, unit: Unit) -> String {
    let change_kg = now_kg - before_kg;
    let change = match change_kg {
        _ if change_kg > NEGLIGIBLE_KG => format!("add {}", unit.amount(change_kg)),
        _ if change_kg < -NEGLIGIBLE_KG => format!("remove {}", unit.amount(-change_kg)),
        _ => "unchanged".to_string(),
    };
    format!("{} ({change})", total(name, now_kg, unit))
}

fn total(name: &str, kg: f64, unit: Unit) -> String {
    if kg < NEGLIGIBLE_KG {
        format!("{name}: nothing")
    } else {
        format!("{name}: {} in total", unit.amount(kg))
    }
}
