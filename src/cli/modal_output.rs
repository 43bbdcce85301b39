//! Modes, zeros and verdict, as text.

use super::table::{result_table, wrap};
use bench_experiment::outputs::ModalSummary;
use bench_report::figures::{COMPLEX_RESIDUES_NOTE, has_complex_residues, mode_table, zero_table};
use bench_report::table::Width;

/// Tables of modes and zeros, and the verdict.
pub(super) fn text(summary: &ModalSummary, residue_unit: &str) -> String {
    let verdict = format!("CNMP zeros: {}: {}", summary.cnmp.name(), summary.why);
    let verdict = wrap(&verdict, 0);
    if summary.modes.is_empty() {
        return verdict;
    }
    let modes = mode_table(&summary.modes, residue_unit, Width::Terminal);
    let modes = result_table(&modes);
    let zeros = zero_table(&summary.zeros);
    let zeros = if zeros.is_empty() {
        "no zeros in the band of the verdict\n".into()
    } else {
        result_table(&zeros)
    };
    let note = if has_complex_residues(&summary.modes) {
        wrap(COMPLEX_RESIDUES_NOTE, 0)
    } else {
        String::new()
    };
    format!("\n{modes}\n{zeros}\n± is the 95 % confidence interval\n{note}{verdict}")
}
