//! The result of `bench compare` as text.

use super::table::{labelled, table, wrap};
use bench_base::decimal::Decimal;
use bench_experiment::run_comparison::{
    Comparison, Difference, FigureDifference, ModeDifferences, RunDifferences, RunHead,
};
use bench_identify::Estimate;
use bench_identify::verdict::Cnmp;
use bench_report::number::interval;

/// Tables of the differences, and what they mean.
pub(super) fn text(comparison: &Comparison, page: Option<&str>) -> String {
    let runs: String = comparison
        .others
        .iter()
        .map(|other| run_text(&comparison.reference, other))
        .collect();
    let page = page.map_or(String::new(), |page| labelled("page", page));
    runs + &meaning(comparison) + &page
}

fn meaning(comparison: &Comparison) -> String {
    if comparison.tested == 0 {
        return String::new();
    }
    let text = format!(
        "{} of {} differences are significant (*): by the test of Holm, noise alone makes any of them significant with a \
         probability of at most {:.0} %. ± is the 95 % confidence interval of each value by itself; \
         the runs are taken as independent",
        comparison.significant,
        comparison.tested,
        100.0 * comparison.family_false_alarm
    );
    wrap(&text, 0)
}

fn run_text(reference: &RunHead, other: &RunDifferences) -> String {
    let heading = format!("{} compared with {}", other.run.label, reference.label);
    [
        wrap(&heading, 0),
        verdict_text(reference, other),
        settings_text(other),
        modes_text(&other.modes),
        figures_text(&other.figures),
        "\n".into(),
    ]
    .concat()
}

fn verdict_text(reference: &RunHead, other: &RunDifferences) -> String {
    let [first, second] = [reference, &other.run].map(|run| run.cnmp.map(Cnmp::name));
    let verdicts = agreement("CNMP zeros", first, second);
    let [first, second] = [reference, &other.run].map(|run| run.signs.as_deref());
    verdicts + &agreement("signs", first, second)
}

/// Whether both runs show the same; empty if a run shows nothing.
fn agreement(label: &str, reference: Option<&str>, other: Option<&str>) -> String {
    let (Some(reference), Some(other)) = (reference, other) else {
        return String::new();
    };
    let line = if other == reference {
        format!("{other} in both")
    } else {
        format!("DIFFERENT: {other}, reference {reference}")
    };
    labelled(label, &line)
}

fn settings_text(other: &RunDifferences) -> String {
    let settings = other.settings.iter().map(|setting| {
        let shown = |value: &Option<String>| value.clone().unwrap_or_else(|| "not set".into());
        let (here, reference) = (shown(&setting.value), shown(&setting.reference));
        labelled(
            "setting",
            &format!("{} = {here}, reference {reference}", setting.key),
        )
    });
    settings.collect()
}

fn modes_text(modes: &ModeDifferences) -> String {
    let of_modes = modes.modes.iter().flat_map(|mode| {
        let name = format!("mode {:.2} Hz", mode.frequency_hz.reference.value);
        [
            difference_row(&format!("{name}: Hz"), &mode.frequency_hz, 1.0),
            difference_row("damping ratio", &mode.damping_ratio, 1.0),
            difference_row("residue 1/kg", &mode.residue_per_kg, 1.0),
        ]
    });
    let compliance = modes.static_compliance_m_per_n.iter();
    let compliance = compliance.map(|found| difference_row("compliance um/N", found, 1e6));
    let rows: Vec<Vec<String>> = of_modes.chain(compliance).collect();
    let table = if rows.is_empty() {
        String::new()
    } else {
        format!(
            "\n{}",
            table(&["", "reference", "difference", "%", ""], &rows)
        )
    };
    table
        + &unpaired("only in the reference", &modes.only_in_reference_hz)
        + &unpaired("only in this run", &modes.only_in_other_hz)
}

fn difference_row(name: &str, found: &Difference, factor: f64) -> Vec<String> {
    let shown = |estimate: Estimate| {
        let scaled = estimate.scaled(factor);
        interval(scaled.value, scaled.half_width_95())
    };
    let percent = found
        .percent()
        .map(|percent| format!("{:+.3}", Decimal(percent)));
    vec![
        name.into(),
        shown(found.reference),
        shown(found.difference),
        percent.unwrap_or_default(),
        if found.significant { "*" } else { "" }.into(),
    ]
}

fn unpaired(text: &str, frequencies_hz: &[f64]) -> String {
    let shown: Vec<String> = frequencies_hz.iter().map(|hz| format!("{hz:.2}")).collect();
    if shown.is_empty() {
        String::new()
    } else {
        wrap(&format!("{text}: modes at {} Hz", shown.join(", ")), 2)
    }
}

fn figures_text(figures: &[FigureDifference]) -> String {
    let rows: Vec<Vec<String>> = figures.iter().map(figure_row).collect();
    format!(
        "\n{}",
        table(&["", "reference", "this run", "difference"], &rows)
    )
}

fn figure_row(found: &FigureDifference) -> Vec<String> {
    let (name, factor) = found.figure.name_and_factor();
    let shown = |value: Option<f64>| match value {
        Some(value) => {
            let digits = found.figure.decimals();
            format!("{:.digits$}", Decimal(value * factor))
        }
        None => "none".into(),
    };
    vec![
        name.into(),
        shown(found.reference),
        shown(found.other),
        shown(found.difference),
    ]
}
