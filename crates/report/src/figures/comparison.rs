//! The differences of two runs.

use super::{Figure, interval_of};
use crate::number::{percent, plain};
use crate::table::Table;
use bench_base::units::UM_PER_M;
use bench_experiment::run_comparison::{Difference, FigureDifference, ModeDifferences};

/// The differences of the modes. A significant one has a star.
pub fn difference_table(modes: &ModeDifferences) -> Table {
    let of_modes = modes.modes.iter().flat_map(|mode| {
        let hertz = plain(mode.frequency_hz.reference.value, 2);
        [
            difference_row(&format!("mode {hertz} Hz: Hz"), &mode.frequency_hz, 1.0),
            difference_row("damping ratio", &mode.damping_ratio, 1.0),
            difference_row("residue 1/kg", &mode.residue_per_kg, 1.0),
        ]
    });
    let compliance = modes.static_compliance_m_per_n.iter();
    let compliance = compliance.map(|found| difference_row("compliance µm/N", found, UM_PER_M));
    let columns = ["", "Reference", "Difference", "%", "If equal", ""];
    Table::new(columns).with_rows(of_modes.chain(compliance))
}

fn difference_row(name: &str, found: &Difference, factor: f64) -> Vec<String> {
    let ratio = found.percent().map(|percent| plain(percent, 3));
    vec![
        name.into(),
        interval_of(found.reference.scaled(factor)),
        interval_of(found.difference.scaled(factor)),
        ratio.unwrap_or_default(),
        percent(found.probability),
        if found.significant { "*" } else { "" }.into(),
    ]
}

/// The differences of figures whose errors are not known.
pub fn figure_table(figures: &[FigureDifference]) -> Table {
    let columns = ["", "Reference", "This run", "Difference"];
    Table::new(columns).with_rows(figures.iter().map(figure_row))
}

fn figure_row(found: &FigureDifference) -> Vec<String> {
    let (name, factor) = found.figure.name_and_factor();
    let text = |value: Option<f64>| {
        let value = value.map(|value| value * factor);
        Figure::new(name, value, "", found.figure.decimals()).text()
    };
    vec![
        name.into(),
        text(found.reference),
        text(found.other),
        text(found.difference),
    ]
}

/// The frequencies of modes that only one run has: `29.27, 145.10`; `None` without one.
pub fn frequencies(frequencies_hz: &[f64]) -> Option<String> {
    let texts: Vec<String> = frequencies_hz.iter().map(|hz| plain(*hz, 2)).collect();
    (!texts.is_empty()).then(|| texts.join(", "))
}
