//! Modes, zeros and verdict, as text.

use super::table::{table, wrap};
use bench_base::decimal::Decimal;
use bench_experiment::outputs::ModalSummary;
use bench_identify::modal::FittedMode;
use bench_identify::verdict::UncertainZero;

/// Tables of modes and zeros, and the verdict.
pub(super) fn text(summary: &ModalSummary) -> String {
    let verdict = format!("CNMP zeros: {}: {}", summary.cnmp.name(), summary.why);
    let verdict = wrap(&verdict, 0);
    if summary.modes.is_empty() {
        return verdict;
    }
    let header = ["mode Hz", "±", "damping", "±", "residue 1/kg", "±", "sign"];
    let rows: Vec<_> = summary.modes.iter().map(mode_row).collect();
    let modes = table(&header, &rows);
    let zeros = zero_table(&summary.zeros);
    format!("\n{modes}\n{zeros}\n± is the 95 % confidence interval\n{verdict}")
}

fn mode_row(mode: &FittedMode) -> Vec<String> {
    let (frequency_hz, damping_ratio) = (mode.frequency_hz(), mode.damping_ratio);
    vec![
        format!("{:.4}", frequency_hz.value),
        format!("{:.1e}", frequency_hz.half_width_95()),
        format!("{:.6}", Decimal(damping_ratio.value)),
        format!("{:.1e}", damping_ratio.half_width_95()),
        format!("{:+.6}", Decimal(mode.residue_per_kg.value)),
        format!("{:.1e}", mode.residue_per_kg.half_width_95()),
        mode.sign().to_string(),
    ]
}

fn zero_table(zeros: &[UncertainZero]) -> String {
    if zeros.is_empty() {
        return "no zeros in the band of the verdict\n".into();
    }
    let header = ["zero rad/s", "± re", "kind", "right of the axis"];
    let rows: Vec<_> = zeros.iter().map(zero_row).collect();
    table(&header, &rows)
}

fn zero_row(zero: &UncertainZero) -> Vec<String> {
    vec![
        format!("{:+.3} ± {:.3}j", Decimal(zero.s.re), Decimal(zero.s.im)),
        format!("{:.1e}", zero.real_part().half_width_95()),
        zero.kind.name().into(),
        format!("{:.2} %", 100.0 * zero.rhp_probability),
    ]
}
