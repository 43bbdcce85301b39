//! The plants of the delivered profiles, for tests.

use std::path::Path;

use bench_settings::layer::{overlay, same_kind};
use toml::Table;

use crate::PlantSettings;

/// The plant of a profile of `bench-config/`, with changes such as `plant.mass_asymmetry=0.05`.
pub(crate) fn plant_of_profile(profile: &str, sets: &[&str]) -> PlantSettings {
    let mut table = Table::new();
    for name in ["stage", profile] {
        overlay(&mut table, &profile_table(name), same_kind);
    }
    for set in sets {
        overlay(&mut table, &set.parse().expect("KEY=VALUE"), same_kind);
    }
    let plant = table.remove("plant").expect("a plant");
    plant.try_into().expect("settings of a plant")
}

fn profile_table(name: &str) -> Table {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../bench-config");
    let text = std::fs::read_to_string(folder.join(format!("{name}.toml"))).expect("a profile");
    text.parse().expect("TOML")
}
