//! The settings of the delivered profile `stage` that excitations need, for tests.

use bench_plant::PlantSettings;
use serde::Deserialize;

use crate::{
    ChirpSettings, ChosenExcitation, ExcitationKind, ExcitationTables, Limits, SharedSettings,
};

/// The settings.
pub(crate) struct Profile {
    pub kind: ExcitationKind,
    pub chirp: ChirpSettings,
    pub excitations: ExcitationTables,
    pub limits: Limits,
    pub plant: PlantSettings,
    pub amplifier_bandwidth_hz: f64,
    pub force_constant_n_per_a: f64,
}

impl Profile {
    /// The excitation of `kind`.
    pub fn chosen_excitation(&self) -> ChosenExcitation<'_> {
        ChosenExcitation {
            design: self.excitations.design(self.kind).expect("a table"),
            shared: SharedSettings {
                chirp: &self.chirp,
                rate_hz: 1.0 / self.limits.period_s,
            },
        }
    }
}

/// The tables of the file.
#[derive(Deserialize)]
struct Tables {
    #[serde(rename = "loop")]
    servo: toml::Table,
    motor: toml::Table,
    amplifier: toml::Table,
    interlock: toml::Table,
    plant: PlantSettings,
    chirp: ChirpSettings,
    #[serde(flatten)]
    excitations: ExcitationTables,
}

/// The profile.
pub(crate) fn profile() -> Profile {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../bench-config/stage.toml");
    let text = std::fs::read_to_string(path).expect("the profile");
    let tables: Tables = toml::from_str(&text).expect("settings");
    let number = |table: &toml::Table, key: &str| {
        let value = &table[key];
        value
            .as_float()
            .or(value.as_integer().map(|n| n as f64))
            .expect("a number")
    };
    let force_constant_n_per_a = number(&tables.motor, "force_constant_n_per_a");
    Profile {
        kind: ExcitationKind::Chirp,
        limits: Limits {
            travel_m: number(&tables.interlock, "soft_limit_m"),
            peak_current_a: number(&tables.motor, "peak_force_n") / force_constant_n_per_a,
            amplifier_current_a: number(&tables.amplifier, "current_limit_a"),
            continuous_current_a: number(&tables.motor, "continuous_force_n")
                / force_constant_n_per_a,
            slew_a_per_s: number(&tables.amplifier, "slew_limit_a_per_s"),
            thermal_time_constant_s: number(&tables.motor, "thermal_time_constant_s"),
            period_s: 1.0 / number(&tables.servo, "rate_hz"),
        },
        amplifier_bandwidth_hz: number(&tables.amplifier, "bandwidth_hz"),
        force_constant_n_per_a,
        chirp: tables.chirp,
        excitations: tables.excitations,
        plant: tables.plant,
    }
}
