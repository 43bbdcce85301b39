//! The page of a record: the verdict and its reasons first.

use std::f64::consts::TAU;

use super::{Plot, RecordReport};
use crate::figures::{
    COMPLEX_RESIDUES_NOTE, NO_MODES_IN_BAND, has_complex_residues, interval_of, mode_table,
    outside_band_note, zero_table,
};
use crate::html::{document_with_plots, escaped, facts, note, section};
use crate::table::{Table, Width};
use bench_base::decimal::Decimal;
use bench_experiment::certificate::SIGNS_DIFFER;
use bench_identify::modal::{Estimate, FittedMode, ModeLists};

/// The page as an HTML document.
pub fn page(report: &RecordReport<'_>, plots: &[Plot]) -> String {
    let plots: String = plots.iter().map(Plot::section).collect();
    let body = [
        heading(
            report.name.as_deref(),
            &report.title,
            &report.subtitle,
            &report.record,
        ),
        report.ending.clone(),
        other_signs(report),
        verdict(report),
        report.command_and_settings.clone(),
        modes(report),
        zeros(report),
        report.before_plots.clone(),
        plots,
        report.after_plots.clone(),
    ];
    let title = report.name.as_ref().unwrap_or(&report.title);
    document_with_plots(title, &body.concat())
}

/// The heading: the name, if there is one, then the title, with `subtitle` and `record` below.
pub(super) fn heading(name: Option<&str>, title: &str, subtitle: &str, record: &str) -> String {
    let (heading, below) = match name {
        Some(name) => (name, format!("{}<br>", escaped(title))),
        None => (title, String::new()),
    };
    let [heading, subtitle, record] = [heading, subtitle, record].map(escaped);
    format!("<h1>{heading}</h1>\n<p class=\"quiet\">{below}{subtitle}<br>{record}</p>\n")
}

/// A warning in large letters, if the signs of the residues differ from those of the model.
fn other_signs(report: &RecordReport<'_>) -> String {
    let Some(signs) = report.signs.filter(|signs| signs.differ()) else {
        return String::new();
    };
    let (measured, model) = (escaped(&signs.measured), escaped(&signs.model));
    let text = escaped(SIGNS_DIFFER);
    format!(
        "<p class=\"verdict detected\"><strong>THE SIGNS OF THE RESIDUES DIFFER FROM THE MODEL: measured {measured}, model \
         {model}</strong><br>{text}</p>\n"
    )
}

fn verdict(report: &RecordReport<'_>) -> String {
    let name = report.verdict.cnmp.name();
    let why = escaped(&report.verdict.why);
    let evidence = [evidence(report), report.evidence.clone()].concat();
    let text = format!("<p class=\"verdict {name}\"><strong>{name}</strong><br>{why}</p>\n");
    section(
        "Complex non-minimum phase zeros",
        &(text + &facts(&evidence)),
    )
}

/// The figures that support every verdict.
fn evidence(report: &RecordReport<'_>) -> Vec<(String, String)> {
    let limit = format!("{:.1} Hz", report.judged_up_to_rad_s / TAU);
    let chi2 = report.fit.map(|fit| format!("{:.3}", fit.chi2_per_freedom));
    let phase_drop = report.verdict.phase_drop;
    let drop_deg = phase_drop.map(|phase_drop| format!("{:.1} deg", Decimal(phase_drop.drop_deg)));
    named([
        ("Upper limit of the verdict", Some(limit)),
        ("Reduced chi-square of the fit", chi2),
        (
            "Phase lag beyond that of a minimum-phase system of this magnitude",
            drop_deg,
        ),
    ])
}

/// The pairs that have a value.
pub(super) fn named<const N: usize>(pairs: [(&str, Option<String>); N]) -> Vec<(String, String)> {
    pairs
        .into_iter()
        .filter_map(|(name, value)| Some((name.to_string(), value?)))
        .collect()
}

/// A delay in milliseconds with its 95 % interval.
pub(super) fn delay_ms(delay_s: Estimate) -> String {
    format!("{} ms", interval_of(delay_s.scaled(1e3)))
}

/// A section with a note and a table.
pub(super) fn table_section(heading: &str, text: &str, table: &Table) -> String {
    section(heading, &(note(text) + &table.html()))
}

fn modes(report: &RecordReport<'_>) -> String {
    let Some(fit) = report.fit else {
        return String::new();
    };
    let modes = report.verdict.modes(fit);
    let ModeLists { in_band, outside } = ModeLists::new(&modes, fit.band_hz);
    let table = |modes: &[FittedMode]| mode_table(modes, &report.residue_unit, Width::Page).html();
    let mut text = "± is the 95 % confidence interval.".to_string();
    if has_complex_residues(&modes) {
        text += &format!(" {COMPLEX_RESIDUES_NOTE}.");
    }
    let mut content = if in_band.is_empty() {
        note(NO_MODES_IN_BAND)
    } else {
        note(&text) + &table(&in_band)
    };
    if !outside.is_empty() {
        content += &note(&outside_band_note(fit.band_hz));
        content += &table(&outside);
    }
    section("Modes", &content)
}

fn zeros(report: &RecordReport<'_>) -> String {
    let table = zero_table(&report.verdict.zeros);
    if table.is_empty() {
        return String::new();
    }
    let text = "Zeros of the fit up to the limit of the verdict, those first that may lie right of the imaginary axis; of a conjugate pair the one above the real axis. ± is the \
                95 % confidence interval.";
    table_section("Zeros", text, &table)
}
