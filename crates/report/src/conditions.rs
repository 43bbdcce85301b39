//! The conditions under which a plant was measured or computed, as text.

use super::number::plain;
use bench_config::PlantSettings;

/// Operating point and mass asymmetry of a plant that has them, without the settings that vary.
pub fn plant_conditions(plant: &PlantSettings, varied: &[&str]) -> String {
    let shown = |key: &str| !varied.contains(&key);
    let point = plant.operating_point_name();
    let point = point.filter(|_| shown("plant.operating_point_m"));
    let asymmetry = plant.mass_asymmetry();
    let asymmetry = asymmetry.filter(|_| shown("plant.mass_asymmetry"));
    joined(&[
        &point.map_or(String::new(), |name| format!("operating point {name}")),
        &asymmetry.map_or(String::new(), asymmetry_text),
    ])
}

fn asymmetry_text(ratio: f64) -> String {
    format!("mass asymmetry {} %", plain(100.0 * ratio, 1))
}

/// The parts that are not empty, separated by semicolons.
pub fn joined(parts: &[&str]) -> String {
    separated(parts, "; ")
}

/// The parts that are not empty, each on a line of its own.
pub fn lines(parts: &[&str]) -> String {
    separated(parts, ";\n")
}

fn separated(parts: &[&str], separator: &str) -> String {
    let parts: Vec<&str> = parts
        .iter()
        .copied()
        .filter(|part| !part.is_empty())
        .collect();
    parts.join(separator)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_out_empty_parts() {
        assert_eq!(joined(&["a", "", "b"]), "a; b");
        assert_eq!(lines(&["", "a", "b", ""]), "a;\nb");
        assert_eq!(joined(&["", ""]), "");
    }
}
