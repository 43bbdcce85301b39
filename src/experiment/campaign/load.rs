//! What a person hangs on the stage and adds to it, for a point of a grid.

use serde::{Deserialize, Serialize};

use super::CampaignError;
use super::grid::{MASS_STEP_KG, settings};
use crate::config::{CampaignSettings, Config, PlantSettings, Sr4dofSettings};

/// Standard gravity in m/s^2.
const GRAVITY_M_PER_S2: f64 = 9.80665;
/// What is less than half of it is nothing, in kilograms.
const NOTHING_KG: f64 = 0.0005;

/// What is on the stage beyond what it is made of, in kilograms.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Load {
    /// Hangs on the virtual pulley (section 5.1.3) and pulls in +Y; negative: in -Y.
    pub hung_kg: f64,
    /// Added to secondary stage 2.
    pub on_m2_kg: f64,
    /// Added to secondary stage 3.
    pub on_m3_kg: f64,
}

impl Load {
    /// What makes the operating point and the asymmetry of a configuration.
    ///
    /// The weight is F/(g p) with the force F that holds the operating point ([`Sr4dofSettings::holding_force_n`]) and p of `pulley_ratio`. The
    /// masses turn the asymmetry B of the stage as it was built, m2 = m3 (1 + B), into D: m3 (D - B) on stage 2, or, for D < B,
    /// m3 ((1 + B)/(1 + D) - 1) on stage 3, to the nearest step of 0.5 g (section 5.2.1).
    pub fn of(config: &Config) -> Result<Load, CampaignError> {
        let (stage, with) = (settings(config)?, &config.campaign);
        let (wanted, built) = (1.0 + stage.mass_asymmetry, 1.0 + with.built_asymmetry);
        let (m2, m3) = (wanted - built, built / wanted - 1.0);
        let stepped = |share: f64| {
            MASS_STEP_KG
                * libm::round(share.max(0.0) * stage.secondary_stage_mass_kg / MASS_STEP_KG)
        };
        Ok(Load {
            hung_kg: stage.holding_force_n() / (GRAVITY_M_PER_S2 * with.pulley_ratio),
            on_m2_kg: stepped(m2),
            on_m3_kg: stepped(m3),
        })
    }

    /// The force in newtons with which the weight pulls.
    pub fn force_n(&self, with: &CampaignSettings) -> f64 {
        self.hung_kg * GRAVITY_M_PER_S2 * with.pulley_ratio
    }

    /// The model of the stage that carries it: what is added to stage 3 is there beside the asymmetry.
    pub fn carried(&self, config: &Config) -> Result<PlantSettings, CampaignError> {
        let (stage, with) = (settings(config)?, &config.campaign);
        let built_kg = stage.secondary_stage_mass_kg;
        let (m2_kg, m3_kg) = (
            built_kg * (1.0 + with.built_asymmetry) + self.on_m2_kg,
            built_kg + self.on_m3_kg,
        );
        let soft = Sr4dofSettings {
            operating_point_m: 1.0,
            ..stage.clone()
        };
        Ok(PlantSettings::Sr4dof(Sr4dofSettings {
            secondary_stage_mass_kg: m3_kg,
            mass_asymmetry: m2_kg / m3_kg - 1.0,
            operating_point_m: self.force_n(with) / soft.holding_force_n(),
            ..stage.clone()
        }))
    }

    /// What to do where `before` is on the stage: a line each for the weight and both stages.
    pub fn orders(&self, before: &Load) -> [String; 3] {
        // With nothing to hang it is the side that the weight is taken off.
        let down = self.hung_kg < 0.0 || self.hung_kg == 0.0 && before.hung_kg < 0.0;
        let side = if down { "-Y" } else { "+Y" };
        let turned = self.hung_kg * before.hung_kg < 0.0;
        let hung_before_kg = if turned { 0.0 } else { before.hung_kg.abs() };
        let weight = order(
            &format!("weight in {side}"),
            self.hung_kg.abs(),
            hung_before_kg,
            1.0,
            "kg",
        );
        let first = if turned {
            "take the weight off the other side; "
        } else {
            ""
        };
        let gram = |name: &str, now_kg, before_kg| order(name, now_kg, before_kg, 1e3, "g");
        [
            format!("{first}{weight}"),
            gram("on stage 2", self.on_m2_kg, before.on_m2_kg),
            gram("on stage 3", self.on_m3_kg, before.on_m3_kg),
        ]
    }
}

/// How much in all, and what that changes; `per_kg` makes the unit of a person.
fn order(name: &str, now_kg: f64, before_kg: f64, per_kg: f64, unit: &str) -> String {
    let decimals = if unit == "kg" { 3 } else { 1 };
    let amount = |kg: f64| format!("{:.decimals$} {unit}", kg * per_kg);
    let all = if now_kg < NOTHING_KG / 2.0 {
        "nothing".to_string()
    } else {
        format!("{} in all", amount(now_kg))
    };
    let change = match now_kg - before_kg {
        more if more > NOTHING_KG / 2.0 => format!("put on {}", amount(more)),
        less if less < -NOTHING_KG / 2.0 => format!("take off {}", amount(-less)),
        _ => "as it is".to_string(),
    };
    format!("{name}: {all} ({change})")
}
