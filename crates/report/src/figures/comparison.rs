//! The differences of two runs.

use super::{Figure, interval_of};
use crate::number::{percent, plain};
use crate::table::{Table, Width};
use bench_base::units::UM_PER_M;
use bench_experiment::run_comparison::{Difference, FigureDifference, ModeDifferences};

/// Head of the probability of a difference.
pub(crate) const IF_EQUAL: &str = "If equal";

/// The differences of the modes. A significant one has a star. The probability of a difference is for pages.
pub fn difference_table(modes: &ModeDifferences, width: Width) -> Table {
    let row = |name: &str, found: &Difference, factor| difference_row(name, found, factor, width);
    let of_modes = modes.modes.iter().flat_map(|mode| {
        let hertz = plain(mode.frequency_hz.reference.value, 2);
        [
            row(&format!("mode {hertz} Hz: Hz"), &mode.frequency_hz, 1.0),
            row("damping ratio", &mode.damping_ratio, 1.0),
            row("residue 1/kg", &mode.residue_per_kg, 1.0),
        ]
    });
    let compliance = modes.static_compliance_m_per_n.iter();
    let compliance = compliance.map(|found| row("compliance µm/N", found, UM_PER_M));
    let columns = ["", "Reference", "Difference", "%"].into_iter();
    let columns = columns.chain(width.page_only(IF_EQUAL)).chain([""]);
    Table::new(columns).with_rows(of_modes.chain(compliance))
}

fn difference_row(name: &str, found: &Difference, factor: f64, width: Width) -> Vec<String> {
    let ratio = found.percent().map(|percent| plain(percent, 3));
    let mut cells = vec![
        name.into(),
        interval_of(found.reference.scaled(factor)),
        interval_of(found.difference.scaled(factor)),
        ratio.unwrap_or_default(),
    ];
    cells.extend(width.page_only(percent(found.probability)));
    cells.push(if found.significant { "*" } else { "" }.into());
    cells
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

#[cfg(test)]
mod tests {
    use super::*;
    use bench_identify::Estimate;

    #[test]
    fn terminal_has_all_columns_but_the_probability() {
        let [reference, other] = [2.0, 4.0].map(|value| Estimate { value, sigma: 0.5 });
        let modes = ModeDifferences {
            static_compliance_m_per_n: Some(Difference::of(reference, other)),
            ..ModeDifferences::default()
        };
        let [page, terminal] =
            [Width::Page, Width::Terminal].map(|width| difference_table(&modes, width));
        let columns = ["", "Reference", "Difference", "%", IF_EQUAL, ""];
        assert_eq!(page.columns, columns);
        // 2 / sqrt(2 * 0.5^2) = 2.83 sigma, which equal values exceed with a probability of 0.47 %.
        assert_eq!(page.rows[0][4], "0.47 %");
        for (whole, narrow) in [
            (&page.columns, &terminal.columns),
            (&page.rows[0], &terminal.rows[0]),
        ] {
            assert_eq!([&whole[..4], &whole[5..]].concat(), *narrow);
        }
    }
}
