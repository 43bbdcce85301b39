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
pub use veering::{veering_caption, veering_svg};

use super::chart::colours::series_colour as colour;
use super::number::significant;

/// Ends of the keys of settings, with their units; the longer ones first.
const UNITS: [(&str, &str); 14] = [
    ("_n_per_m_per_a", "N/m/A"),
    ("_n_per_m", "N/m"),
    ("_n_per_a", "N/A"),
    ("_ns_per_m", "N s/m"),
    ("_kg_m2", "kg m²"),
    ("_rad_s", "rad/s"),
    ("_rad", "rad"),
    ("_kg", "kg"),
    ("_pa", "Pa"),
    ("_n", "N"),
    ("_hz", "Hz"),
    ("_m", "m"),
    ("_s", "s"),
    ("_a", "A"),
];

/// A setting with its unit, as the label of an axis. A setting without a unit in its key is a ratio or a number.
fn setting_label(key: &str) -> String {
    unit(key).map_or(key.into(), |unit| format!("{key} ({unit})"))
}

/// A value of a setting with its unit.
fn setting_text(key: &str, value: f64) -> String {
    let number = setting_number(value);
    match unit(key) {
        Some(unit) => format!("{number} {unit}"),
        None => number,
    }
}

/// A value of a setting with four significant digits, without zeros at its end.
fn setting_number(value: f64) -> String {
    let size = if value == 0.0 {
        "0".into()
    } else {
        significant(value.abs(), 4)
    };
    let size = if size.contains('.') {
        size.trim_end_matches('0').trim_end_matches('.')
    } else {
        &size
    };
    let sign = if value < 0.0 { "\u{2212}" } else { "" };
    format!("{sign}{size}")
}

fn unit(key: &str) -> Option<&'static str> {
    let unit = UNITS.iter().find(|(end, _)| key.ends_with(end));
    unit.map(|(_, unit)| *unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writes_a_value_with_four_digits_and_its_unit() {
        for (key, value, text) in [
            ("plant.operating_point_m", 0.003_071_46, "0.003071 m"),
            ("plant.operating_point_m", 0.0, "0 m"),
            ("plant.mass_asymmetry", -0.1, "\u{2212}0.1"),
            ("plant.spring_n_per_m", 12_345.6, "12346 N/m"),
        ] {
            assert_eq!(setting_text(key, value), text);
        }
    }

    #[test]
    fn labels_a_setting_with_its_unit() {
        for (key, label) in [
            ("plant.operating_point_m", "plant.operating_point_m (m)"),
            ("plant.spring_n_per_m", "plant.spring_n_per_m (N/m)"),
            ("plant.mass_asymmetry", "plant.mass_asymmetry"),
        ] {
            assert_eq!(setting_label(key), label);
        }
    }
}
