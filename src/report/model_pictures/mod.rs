//! Pictures of results of the model: CNMP map, locus of zeros, veering, step response and tolerance study.

mod locus;
mod map;
mod step;
mod study;
mod veering;

pub use locus::locus_svg;
pub use map::{CnmpMap, map_svg};
pub use step::model_step_svg;
pub use study::study_svg;
pub use veering::veering_svg;

use super::chart::colours::{BLUE, Colour, GREEN, ORANGE, PURPLE, SKY, VERMILION};

/// Colours of curves of one kind.
const COLOURS: [Colour; 6] = [BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY];
/// Ends of the keys of settings, with their units; the longer ones first.
const UNITS: [(&str, &str); 11] = [
    ("_n_per_m_per_a", "N/m/A"),
    ("_n_per_m", "N/m"),
    ("_n_per_a", "N/A"),
    ("_ns_per_m", "N s/m"),
    ("_kg_m2", "kg m²"),
    ("_rad_s", "rad/s"),
    ("_kg", "kg"),
    ("_hz", "Hz"),
    ("_m", "m"),
    ("_s", "s"),
    ("_a", "A"),
];

fn colour(index: usize) -> Colour {
    COLOURS[index % COLOURS.len()]
}

/// A setting with its unit, as the label of an axis.
fn setting_label(key: &str) -> String {
    let unit = UNITS.iter().find(|(end, _)| key.ends_with(end));
    format!("{key} ({})", unit.map_or("SI unit", |(_, unit)| unit))
}

#[cfg(test)]
mod tests {
    use super::setting_label;

    #[test]
    fn labels_a_setting_with_its_unit() {
        for (key, label) in [
            ("plant.operating_point_m", "plant.operating_point_m (m)"),
            ("plant.spring_n_per_m", "plant.spring_n_per_m (N/m)"),
            ("plant.mass_asymmetry", "plant.mass_asymmetry (SI unit)"),
        ] {
            assert_eq!(setting_label(key), label);
        }
    }
}
