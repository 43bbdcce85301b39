//! Figures of static steps and of the check of a stage.

use super::{Figure, beside};
use crate::number::plain;
use crate::table::Table;
use bench_base::units::UM_PER_M;
use bench_experiment::calibration::StaircaseResult;
use bench_experiment::stage_check::{PhaseComparison, StageCheck};
use bench_identify::Estimate;

const MA_PER_A: f64 = 1e3;
const COMPLIANCE: &str = "Static compliance";

/// The figures of static steps, beside those of the model.
pub fn static_step_table(found: &StaircaseResult) -> Table {
    let fit = &found.fit;
    let compliance = Estimate {
        value: fit.compliance_m_per_a,
        sigma: fit.compliance_sigma_m_per_a,
    };
    let percent = |name, ratio: f64| Figure::new(name, 100.0 * ratio, "%", 4);
    let micrometres = |name, metres: f64, decimals| {
        Figure::new(name, metres, "m", decimals).times(UM_PER_M, "µm")
    };
    let mut measured = vec![
        Figure::new(COMPLIANCE, compliance, "m/A", 3).times(UM_PER_M, "µm/A"),
        percent("Deviation from a straight line", fit.nonlinearity_ratio),
        percent(
            "Difference between rising and falling current",
            fit.hysteresis_ratio,
        ),
        micrometres("Reading without current", fit.rest_m, 3),
        micrometres("Noise of the readings (RMS)", fit.noise_rms_m, 4),
    ];
    if let Some((gain, offset_a)) = fit.current {
        measured.extend([
            Figure::new("Measured current per ampere", gain, "A", 5),
            Figure::new("Measured current at zero", offset_a, "A", 3).times(MA_PER_A, "mA"),
        ]);
    }
    let model = Figure::new(COMPLIANCE, found.model_m_per_a, "m/A", 3).times(UM_PER_M, "µm/A");
    beside(&measured, &[model])
}

/// What was compared with the certificate.
pub fn stage_check_table(check: &StageCheck) -> Table {
    let compliance = &check.compliance;
    let compliance = vec![
        "Static compliance (µm/A)".into(),
        plain(UM_PER_M * compliance.measured_m_per_a, 3),
        plain(UM_PER_M * compliance.certified_m_per_a, 3),
        format!("{} %", plain(100.0 * compliance.limit_ratio, 2)),
    ];
    let columns = ["", "Measured", "By the certificate", "Largest difference"];
    Table::new(columns)
        .with_rows([compliance])
        .with_rows(check.phases.iter().map(phase_row))
}

fn phase_row(phase: &PhaseComparison) -> Vec<String> {
    vec![
        format!("Phase at {} Hz (deg)", plain(phase.frequency_hz, 2)),
        plain(phase.measured_deg, 2),
        plain(phase.certified_deg, 2),
        plain(phase.limit_deg, 2),
    ]
}
