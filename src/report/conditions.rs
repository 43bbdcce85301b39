//! The conditions under which a plant was measured or computed, as text.

use super::number::plain;
use crate::config::PlantSettings;

/// Operating point and mass asymmetry of a plant that has them, without the settings that vary.
pub fn plant_conditions(plant: &PlantSettings, varied: &[&str]) -> String {
    let point = plant.operating_point_name();
    let point = point.map(|name| ("plant.operating_point_m", format!("operating point {name}")));
    let asymmetry = plant.mass_asymmetry().map(|ratio| {
        let percent = plain(100.0 * ratio, 1);
        (
            "plant.mass_asymmetry",
            format!("mass asymmetry {percent} %"),
        )
    });
    let parts = point.into_iter().chain(asymmetry);
    let fixed = parts.filter(|(key, _)| !varied.contains(key));
    let texts: Vec<String> = fixed.map(|(_, text)| text).collect();
    texts.join("; ")
}
