//! The page of a record: the verdict and its reasons first.

use super::{Plot, ReportSource, Shown};
use crate::identify::modal::{Estimate, FittedMode, SIGMAS_95};
use crate::identify::verdict::UncertainZero;
use crate::report::number::{interval, percent};
use crate::report::page::{document, escaped, facts, picture, row, table};

const HERTZ: f64 = 2.0 * std::f64::consts::PI;

/// The page, as an HTML document.
pub fn page(record: &dyn ReportSource, pictures: &[Plot]) -> String {
    let shown = record.shown();
    let (before, behind) = record.sections();
    let pictures: String = pictures
        .iter()
        .map(|p| {
            format!(
                "<section>\n<h2>{}</h2>\n{}</section>\n",
                escaped(p.heading),
                picture(&p.svg, p.heading, &p.caption)
            )
        })
        .collect();
    let body = format!(
        "<h1>{}</h1>\n<p class=\"quiet\">{}<br>{}</p>\n{}{}{}{before}{pictures}{behind}",
        escaped(&shown.title),
        escaped(&shown.subtitle),
        escaped(&record.record()),
        verdict(&shown, record),
        modes(&shown),
        zeros(&shown),
    );
    document(&shown.title, &body)
}

fn verdict(shown: &Shown<'_>, record: &dyn ReportSource) -> String {
    let name = shown.verdict.cnmp.name();
    let all: Vec<_> = evidence(shown)
        .into_iter()
        .chain(record.evidence())
        .collect();
    format!(
        "<section>\n<h2>Complex non-minimum phase zeros</h2>\n<p class=\"verdict {name}\"><strong>{name}</strong><br>{}</p>\n{}</section>\n",
        escaped(&shown.verdict.why),
        facts(&all)
    )
}

/// The numbers that a verdict rests on.
fn evidence(shown: &Shown<'_>) -> Vec<(String, String)> {
    let judged = format!("{:.1} Hz", shown.judged_up_to_rad_s / HERTZ);
    let power = shown
        .fit
        .map(|fit| format!("{:.3} times that of the noise", fit.chi2_per_freedom));
    let fall = shown.verdict.phase.map(|p| {
        format!(
            "{:.1} deg beyond what the magnitude asks for",
            -p.excess_phase_deg
        )
    });
    let pairs = [
        ("Judged up to", Some(judged)),
        ("Power that the fit leaves", power),
        ("Fall of the phase", fall),
    ];
    pairs
        .into_iter()
        .filter_map(|(name, text)| Some((name.to_string(), text?)))
        .collect()
}

/// A delay in milliseconds with its interval.
pub(super) fn delay_ms(delay_s: Estimate) -> String {
    format!(
        "{} ms",
        interval(1e3 * delay_s.value, 1e3 * SIGMAS_95 * delay_s.sigma)
    )
}

fn modes(shown: &Shown<'_>) -> String {
    let Some(fit) = shown.fit else {
        return String::new();
    };
    let residue = escaped(&format!("Residue ({})", shown.residue_unit));
    let header = [
        "Frequency (Hz)",
        "Damping (%)",
        &residue,
        "Sign",
        "Other sign",
    ];
    let rows: String = fit.modes().iter().map(mode).collect();
    section(
        "Modes",
        "Intervals hold the truth with 95 %; beside the sign the probability that it is the other one.",
        &header,
        &rows,
    )
}

fn mode(mode: &FittedMode) -> String {
    let scaled =
        |e: Estimate, factor: f64| interval(e.value * factor, SIGMAS_95 * e.sigma * factor);
    row(&[
        scaled(mode.omega_rad_s, 1.0 / HERTZ),
        scaled(mode.damping_ratio, 100.0),
        scaled(mode.residue_per_kg, 1.0),
        if mode.sign() == '+' {
            "+".into()
        } else {
            "\u{2212}".into()
        },
        percent(mode.sign_error_probability()),
    ])
}

fn zeros(shown: &Shown<'_>) -> String {
    let zeros = &shown.verdict.zeros;
    if zeros.is_empty() {
        return String::new();
    }
    let header = [
        "|s| (Hz)",
        "Real part (rad/s)",
        "Imaginary part (rad/s)",
        "Kind",
        "Right of the axis",
    ];
    let words = "Of the fit, up to where it is judged; of a conjugate pair the one above the real axis. Intervals hold each part with 95 %.";
    section(
        "Zeros",
        words,
        &header,
        &zeros.iter().map(zero).collect::<String>(),
    )
}

fn zero(zero: &UncertainZero) -> String {
    let part = |value: f64, k: usize| interval(value, SIGMAS_95 * zero.covariance[k][k].sqrt());
    row(&[
        format!("{:.3}", zero.s.norm() / HERTZ),
        part(zero.s.re, 0),
        if zero.s.im == 0.0 {
            "0".into()
        } else {
            part(zero.s.im, 1)
        },
        zero.kind.name().into(),
        percent(zero.rhp_probability),
    ])
}

pub(super) fn section(heading: &str, words: &str, header: &[&str], rows: &str) -> String {
    format!(
        "<section>\n<h2>{heading}</h2>\n<p class=\"quiet\">{words}</p>\n<div class=\"wide\">{}</div>\n</section>\n",
        table(header, rows)
    )
}
