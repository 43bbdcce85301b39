//! The result of `bench compare` as text.

use super::table::{labelled, result_table, wrap};
use bench_experiment::run_comparison::{
    Comparison, FigureDifference, ModeDifferences, RunDifferences, RunHead,
};
use bench_identify::verdict::Cnmp;
use bench_report::figures::{difference_table, figure_table, frequencies};
use bench_report::table::Width;

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
    let differences = difference_table(modes, Width::Terminal);
    let differences = if differences.is_empty() {
        String::new()
    } else {
        format!("\n{}", result_table(&differences))
    };
    differences
        + &unpaired("only in the reference", &modes.only_in_reference_hz)
        + &unpaired("only in this run", &modes.only_in_other_hz)
}

fn unpaired(text: &str, frequencies_hz: &[f64]) -> String {
    let shown = frequencies(frequencies_hz);
    shown.map_or(String::new(), |shown| {
        wrap(&format!("{text}: modes at {shown} Hz"), 2)
    })
}

fn figures_text(figures: &[FigureDifference]) -> String {
    format!("\n{}", result_table(&figure_table(figures)))
}
