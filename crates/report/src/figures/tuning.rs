//! Figures of a designed controller.

use super::interval_of;
use crate::number::plain;
use crate::table::Table;
use bench_base::units::UM_PER_M;
use bench_control::tuning::{Binding, PlantFigures};
use bench_experiment::tuning::{FrfEvidence, ModeRole};

/// The figures of each plant.
pub fn plant_table(plants: &[PlantFigures]) -> Table {
    let columns = [
        "Plant",
        "Margin",
        "Slope",
        "Bandwidth",
        "|S| at 10",
        "|KS| A/µm",
        "RMS µm",
        "RMS A",
        "Gain margin",
        "Phase deg",
    ];
    Table::new(columns).with_rows(plants.iter().map(plant_row))
}

fn plant_row(figures: &PlantFigures) -> Vec<String> {
    let error_rms_um = figures.error_rms_m.map(|rms_m| rms_m * UM_PER_M);
    vec![
        figures.plant.clone(),
        plain(figures.modulus_margin, 4),
        plain(figures.slope_bandwidth_rad_s, 1),
        plain(figures.sensitivity_bandwidth_rad_s, 1),
        plain(figures.sensitivity_at_10_rad_s, 4),
        plain(figures.control_sensitivity_a_per_um, 4),
        optional(error_rms_um, 4),
        optional(figures.current_rms_a, 4),
        optional(figures.gain_margin, 2),
        optional(figures.phase_margin_deg, 1),
    ]
}

/// A number, or a dash if there is none.
fn optional(value: Option<f64>, digits: usize) -> String {
    value.map_or("–".into(), |value| plain(value, digits))
}

/// The requirements that limit the design.
pub fn binding_table(binding: &[Binding]) -> Table {
    let columns = [
        "Requirement that limits the design",
        "Plant",
        "rad/s",
        "Slack %",
    ];
    Table::new(columns).with_rows(binding.iter().map(binding_row))
}

fn binding_row(binding: &Binding) -> Vec<String> {
    let frequency = binding.frequency_rad_s;
    vec![
        binding.requirement.to_string(),
        binding.plant.clone(),
        frequency.map_or("all".into(), |omega_rad_s| plain(omega_rad_s, 1)),
        plain(100.0 * binding.slack, 2),
    ]
}

/// The evidence of measured responses.
pub fn frf_table(frfs: &[FrfEvidence]) -> Table {
    let columns = [
        "Plant",
        "Lower margin",
        "At Hz",
        "Modulus margin",
        "Band Hz",
        "CNMP zeros",
        "Modes used with sign (Hz)",
        "Tolerated above µm/A",
    ];
    Table::new(columns).with_rows(frfs.iter().map(frf_row))
}

fn frf_row(frf: &FrfEvidence) -> Vec<String> {
    let [first_hz, last_hz] = frf.band_hz;
    vec![
        frf.plant.clone(),
        plain(frf.modulus_margin_lower, 4),
        plain(frf.modulus_margin_lower_at_hz, 2),
        frf.modulus_margin.map_or("–".into(), interval_of),
        format!("{first_hz:.2} to {last_hz:.1}"),
        frf.cnmp.name().to_string(),
        signed_modes(frf),
        plain(frf.tolerated_above_m_per_a * UM_PER_M, 3),
    ]
}

/// Frequency and sign of each mode that is used with its sign.
fn signed_modes(frf: &FrfEvidence) -> String {
    let modes = frf.modes.iter();
    let signed = modes.filter(|used| used.role == ModeRole::Signed);
    let texts: Vec<String> = signed
        .map(|used| format!("{:.2} {}", used.mode.frequency_hz().value, used.mode.sign()))
        .collect();
    texts.join(", ")
}
