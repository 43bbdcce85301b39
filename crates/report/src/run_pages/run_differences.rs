//! The tables of a comparison of runs: settings, verdicts, modes, figures.

use super::page::table_section;
use super::run_facts::setting_cell;
use crate::html::{note, row, section, table};
use crate::number::{interval, percent, plain};
use bench_experiment::run_comparison::{
    Comparison, Difference, FigureDifference, ModeDifferences, RunDifferences, RunHead,
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
    let header = ["", "Recording", "End", "CNMP zeros", "Signs"];
    let others = comparison.others.iter().map(|other| &other.run);
    let heads = std::iter::once(&comparison.reference).chain(others);
    let rows: String = heads.map(head_row).collect();
    let text = format!(
        "{} of {} tested differences from the first run are significant. The test of Holm limits the probability that noise alone \
         makes any of them significant to {:.0} %. The runs are taken as independent.",
        comparison.significant,
        comparison.tested,
        100.0 * comparison.family_false_alarm
    );
    table_section("Differences", &text, &header, &rows)
}

fn head_row(head: &RunHead) -> String {
    let or_empty = |text: Option<String>| text.unwrap_or_default();
    row(&[
        head.label.clone(),
        head.recording.clone(),
        head.outcome.name().replace('_', " "),
        or_empty(head.cnmp.map(|cnmp| cnmp.name().to_string())),
        or_empty(head.signs.clone()),
    ])
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
    if modes.modes.is_empty() && modes.static_compliance_m_per_n.is_none() {
        return String::new();
    }
    let header = [
        "Quantity",
        "Reference",
        "Difference",
        "%",
        "Probability if equal",
        "Significant",
    ];
    let of_modes = modes.modes.iter().map(|mode| {
        let hertz = plain(mode.frequency_hz.reference.value, 2);
        [
            difference_row(
                &format!("Frequency (Hz), mode at {hertz} Hz"),
                &mode.frequency_hz,
                1.0,
            ),
            difference_row("Damping ratio", &mode.damping_ratio, 1.0),
            difference_row("Residue (1/kg)", &mode.residue_per_kg, 1.0),
        ]
        .concat()
    });
    let compliance = modes.static_compliance_m_per_n.iter();
    let compliance = compliance.map(|found| difference_row("Static compliance (µm/N)", found, 1e6));
    let rows: String = of_modes.chain(compliance).collect();
    note("± is the 95 % confidence interval of each value by itself.")
        + &table(&header, &rows)
        + &unpaired("Only in the reference run", &modes.only_in_reference_hz)
        + &unpaired("Only in this run", &modes.only_in_other_hz)
}

fn difference_row(name: &str, found: &Difference, factor: f64) -> String {
    let shown = |estimate: bench_identify::Estimate| {
        let scaled = estimate.scaled(factor);
        interval(scaled.value, scaled.half_width_95())
    };
    row(&[
        name.into(),
        shown(found.reference),
        shown(found.difference),
        found
            .percent()
            .map_or(String::new(), |percent| plain(percent, 3)),
        percent(found.probability),
        if found.significant { "yes" } else { "no" }.into(),
    ])
}

fn unpaired(text: &str, frequencies_hz: &[f64]) -> String {
    let shown: Vec<String> = frequencies_hz.iter().map(|hz| plain(*hz, 2)).collect();
    if shown.is_empty() {
        String::new()
    } else {
        note(&format!("{text}: modes at {} Hz.", shown.join(", ")))
    }
}

fn figures(figures: &[FigureDifference]) -> String {
    let header = ["Figure", "Reference", "Here", "Difference"];
    let rows: String = figures.iter().map(figure_row).collect();
    note("The errors of these figures are not known, so that no significance is stated.")
        + &table(&header, &rows)
}

fn figure_row(found: &FigureDifference) -> String {
    let (name, factor) = found.figure.name_and_factor();
    let shown = |value: Option<f64>| {
        value.map_or("none".into(), |value| {
            plain(value * factor, found.figure.decimals())
        })
    };
    row(&[
        name.into(),
        shown(found.reference),
        shown(found.other),
        shown(found.difference),
    ])
}

fn settings(other: &RunDifferences) -> String {
    if other.settings.is_empty() {
        return note("Both runs had the same settings.");
    }
    let rows: String = other
        .settings
        .iter()
        .map(|setting| {
            row(&[
                setting.key.clone(),
                setting_cell(setting.reference.as_deref()),
                setting_cell(setting.value.as_deref()),
            ])
        })
        .collect();
    note("Settings that differ:") + &table(&["Setting", "Reference", "Here"], &rows)
}
