//! Modes, zeros and verdict, as text.

use super::table::{result_table, wrap};
use bench_experiment::outputs::ModalSummary;
use bench_identify::modal::{FittedMode, ModeLists};
use bench_report::figures::{
    COMPLEX_RESIDUES_NOTE, NO_MODES_IN_BAND, has_complex_residues, mode_table, outside_band_note,
    zero_table,
};
use bench_report::table::Width;

/// How well modes describe the response, or that there are none.
pub(super) fn fit_text(summary: &ModalSummary) -> String {
    match summary.fit_chi2_per_freedom {
        Some(chi2) => format!("  fit        reduced chi-square {chi2:.3}\n"),
        None => "  fit        no modes\n".into(),
    }
}

/// Tables of modes and zeros, and the verdict.
pub(super) fn text(summary: &ModalSummary, residue_unit: &str) -> String {
    let verdict = format!("CNMP zeros: {}: {}", summary.cnmp.name(), summary.why);
    let verdict = wrap(&verdict, 0);
    if summary.modes.is_empty() {
        return verdict;
    }
    let modes = mode_tables(summary, residue_unit);
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

/// The modes in the band, and those outside in a table of their own.
fn mode_tables(summary: &ModalSummary, residue_unit: &str) -> String {
    let table =
        |modes: &[FittedMode]| result_table(&mode_table(modes, residue_unit, Width::Terminal));
    let Some(band_hz) = summary.fit_band_hz else {
        return table(&summary.modes);
    };
    let ModeLists { in_band, outside } = ModeLists::new(&summary.modes, band_hz);
    if outside.is_empty() {
        return table(&in_band);
    }
    let note = wrap(&outside_band_note(band_hz), 0);
    let in_band = if in_band.is_empty() {
        format!("{NO_MODES_IN_BAND}\n")
    } else {
        table(&in_band)
    };
    format!("{in_band}\n{note}\n{}", table(&outside))
}
