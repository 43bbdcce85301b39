//! The page of a record: the verdict and its reasons first.

use std::f64::consts::TAU;

use super::{Plot, RecordReport};
use crate::html::{document_with_plots, escaped, facts, note, row, section, table};
use crate::number::{interval, percent};
use bench_base::decimal::Decimal;
use bench_experiment::certificate::SIGNS_DIFFER;
use bench_identify::modal::{Estimate, FittedMode, SIGMAS_95};
use bench_identify::verdict::UncertainZero;

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

/// An estimate with its 95 % interval.
pub(super) fn with_interval(estimate: Estimate, factor: f64) -> String {
    interval(estimate.value * factor, SIGMAS_95 * estimate.sigma * factor)
}

/// A delay in milliseconds with its 95 % interval.
pub(super) fn delay_ms(delay_s: Estimate) -> String {
    format!("{} ms", with_interval(delay_s, 1e3))
}

/// A section with a note and a table.
pub(super) fn table_section(heading: &str, text: &str, header: &[&str], rows: &str) -> String {
    section(heading, &(note(text) + &table(header, rows)))
}

fn modes(report: &RecordReport<'_>) -> String {
    let Some(fit) = report.fit else {
        return String::new();
    };
    let residue = format!("Residue ({})", report.residue_unit);
    let header = [
        "Frequency (Hz)",
        "Damping ratio",
        &residue,
        "Sign",
        "Probability of the other sign",
    ];
    let rows: String = fit.modes().iter().map(mode_row).collect();
    table_section(
        "Modes",
        "± is the 95 % confidence interval.",
        &header,
        &rows,
    )
}

fn mode_row(mode: &FittedMode) -> String {
    let sign = if mode.sign() == '+' { "+" } else { "\u{2212}" };
    row(&[
        with_interval(mode.omega_rad_s, 1.0 / TAU),
        with_interval(mode.damping_ratio, 1.0),
        with_interval(mode.residue_per_kg, 1.0),
        sign.into(),
        percent(mode.sign_error_probability()),
    ])
}

fn zeros(report: &RecordReport<'_>) -> String {
    let zeros = &report.verdict.zeros;
    if zeros.is_empty() {
        return String::new();
    }
    let header = [
        "|s| (Hz)",
        "Real part (rad/s)",
        "Imaginary part (rad/s)",
        "Kind",
        "Probability right of the imaginary axis",
    ];
    let text = "Zeros of the fit up to the limit of the verdict; of a conjugate pair the one above the real axis. ± is the \
                95 % confidence interval.";
    let rows: String = zeros.iter().map(zero_row).collect();
    table_section("Zeros", text, &header, &rows)
}

fn zero_row(zero: &UncertainZero) -> String {
    let half_widths = [0, 1].map(|k| SIGMAS_95 * zero.covariance[k][k].sqrt());
    row(&[
        format!("{:.3}", zero.s.norm() / TAU),
        interval(zero.s.re, half_widths[0]),
        if zero.s.im == 0.0 {
            "0".into()
        } else {
            interval(zero.s.im, half_widths[1])
        },
        zero.kind.name().into(),
        percent(zero.rhp_probability),
    ])
}
