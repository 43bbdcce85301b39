//! Keys of earlier versions: translated in recordings, refused with the new name elsewhere.

use bench_settings::check::RenamedKeys;
use toml::{Table, Value};

/// Old path, new key within the same table.
pub(super) const RENAMED: RenamedKeys = &[
    ("amplifier.device.when_unheard", "on_communication_loss"),
    ("calibrate.largest_hysteresis_ratio", "max_hysteresis_ratio"),
    (
        "calibrate.largest_nonlinearity_ratio",
        "max_nonlinearity_ratio",
    ),
    ("calibration.when_foreign", "when_other_devices"),
    ("campaign.askew_rad", "cable_misalignment_rad"),
    ("control.least_modulus_margin", "min_modulus_margin"),
];

/// Gives the keys of a recorded configuration their new names.
pub(super) fn translate(config: &mut Table) {
    for (path, new) in RENAMED {
        rename(config, path, new);
    }
}

fn rename(table: &mut Table, path: &str, new: &str) {
    match path.split_once('.') {
        Some((outer, inner)) => {
            if let Some(Value::Table(table)) = table.get_mut(outer) {
                rename(table, inner, new);
            }
        }
        None => {
            if let Some(value) = table.remove(path) {
                table.insert(new.into(), value);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn translates_the_keys_of_an_earlier_recording() {
        let text =
            "[control]\nleast_modulus_margin = 0.3\n[amplifier.device]\nwhen_unheard = \"fault\"\n";
        let mut config: Table = text.parse().unwrap();
        translate(&mut config);
        assert_eq!(
            config["control"]["min_modulus_margin"].as_float(),
            Some(0.3)
        );
        let device = config["amplifier"]["device"].as_table().unwrap();
        assert_eq!(device["on_communication_loss"].as_str(), Some("fault"));
        assert!(!device.contains_key("when_unheard"));
    }
}
