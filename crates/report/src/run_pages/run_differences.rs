//! The tables of a comparison of runs: settings, verdicts, modes, figures.

use super::page::table_section;
use super::run_facts::setting_row;
use crate::figures::{IF_EQUAL, difference_table, figure_table, frequencies};
use crate::html::{note, section};
use crate::table::{Table, Width};
use bench_experiment::run_comparison::{
    Comparison, FigureDifference, ModeDifferences, RunDifferences, RunHead,
};

/// All tables of a comparison.
pub(super) fn differences(comparison: &Comparison) -> String {
    let runs: String = comparison
        .others
        .iter()
        .map(|other| run_sections(&comparison.reference, other))
        .collect();
    summary(comparison) + &runs
}

fn summary(comparison: &Comparison) -> String {
    let columns = ["", "Recording", "End", "CNMP zeros", "Signs"];
    let others = comparison.others.iter().map(|other| &other.run);
    let heads = std::iter::once(&comparison.reference).chain(others);
    let table = Table::new(columns).with_rows(heads.map(head_row));
    let text = format!(
        "{} of {} tested differences from the first run are significant. The test of Holm limits the probability that noise alone \
         makes any of them significant to {:.0} %. The runs are taken as independent.",
        comparison.significant,
        comparison.tested,
        100.0 * comparison.family_false_alarm
    );
    table_section("Differences", &text, &table)
}

fn head_row(head: &RunHead) -> Vec<String> {
    let or_empty = |text: Option<String>| text.unwrap_or_default();
    vec![
        head.label.clone(),
        head.recording.clone(),
        head.outcome.name().replace('_', " "),
        or_empty(head.cnmp.map(|cnmp| cnmp.name().to_string())),
        or_empty(head.signs.clone()),
    ]
}

fn run_sections(reference: &RunHead, other: &RunDifferences) -> String {
    let heading = format!("{} compared with {}", other.run.label, reference.label);
    let parts = [
        remarks(other),
        modes(&other.modes),
        figures(&other.figures),
        settings(other),
    ];
    section(&heading, &parts.concat())
}

/// Differences that are no numbers.
fn remarks(other: &RunDifferences) -> String {
    let remarks = [
        (other.verdict_differs, "The verdicts on CNMP zeros differ."),
        (other.signs_differ, "The signs of the residues differ."),
    ];
    let found = remarks.iter().filter(|(differs, _)| *differs == Some(true));
    found
        .map(|(_, text)| format!("<p class=\"differs\">{text}</p>\n"))
        .collect()
}

fn modes(modes: &ModeDifferences) -> String {
    let table = difference_table(modes, Width::Page);
    if table.is_empty() {
        return String::new();
    }
    note(&modes_note())
        + &table.html()
        + &unpaired("Only in the reference run", &modes.only_in_reference_hz)
        + &unpaired("Only in this run", &modes.only_in_other_hz)
}

fn modes_note() -> String {
    format!(
        "± is the 95 % confidence interval of each value by itself. \"{IF_EQUAL}\" is the probability of such a difference, or a \
         larger one, if the values are equal. * is a significant difference."
    )
}

fn unpaired(text: &str, frequencies_hz: &[f64]) -> String {
    let shown = frequencies(frequencies_hz);
    shown.map_or(String::new(), |shown| {
        note(&format!("{text}: modes at {shown} Hz."))
    })
}

fn figures(figures: &[FigureDifference]) -> String {
    note("The errors of these figures are not known, so that no significance is stated.")
        + &figure_table(figures).html()
}

fn settings(other: &RunDifferences) -> String {
    if other.settings.is_empty() {
        return note("Both runs had the same settings.");
    }
    let columns = ["Setting", "Here", "Reference"];
    let table = Table::new(columns).with_rows(other.settings.iter().map(setting_row));
    note("Settings that differ:") + &table.html()
}
