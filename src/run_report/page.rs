//! The page of a run: the verdict and its reasons first.

use super::{AnalysedRun, Picture};
use crate::fit::{Estimate, FittedMode, SIGMAS_95};

use crate::report::number::{interval, percent};
use crate::report::page::{document, escaped, facts, picture, row, table};
use crate::verdict::UncertainZero;

const HERTZ: f64 = 2.0 * std::f64::consts::PI;

/// The page, as an HTML document.
pub fn page(run: &AnalysedRun<'_>, pictures: &[Picture]) -> String {
    let title = &run.config.title;
    let name = run.recording.path().file_name().unwrap_or_default().to_string_lossy();
    let shown: String = pictures
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
        "<h1>{}</h1>\n<p class=\"quiet\">{}<br>Recording {}</p>\n{}{}{}{}{shown}{}",
        escaped(title),
        escaped(&run.subtitle()),
        escaped(&name),
        verdict(run),
        modes(run),
        zeros(run),
        margins(run),
        loop_facts(run) + &configuration(run),
    );
    document(title, &body)
}

fn verdict(run: &AnalysedRun<'_>) -> String {
    let verdict = &run.analysis.verdict;
    let name = verdict.cnmp.name();
    format!(
        "<section>\n<h2>Complex non-minimum phase zeros</h2>\n<p class=\"verdict {name}\"><strong>{name}</strong><br>{}</p>\n{}</section>\n",
        escaped(&verdict.why),
        facts(&evidence(run))
    )
}

/// The numbers that a verdict rests on.
fn evidence(run: &AnalysedRun<'_>) -> Vec<(String, String)> {
    let (analysis, milli) = (run.analysis, 1e3);
    let fit = analysis.fit.as_ref().ok();
    let judged = format!("{:.1} Hz", analysis.judged_up_to_rad_s / HERTZ);
    let power = fit.map(|fit| format!("{:.3} times that of the noise", fit.chi2_per_freedom));
    let fall = analysis.verdict.phase.map(|p| format!("{:.1} deg beyond what the magnitude asks for", -p.beyond_deg));
    let fitted = fit.map(|fit| {
        let delay = fit.delay_s();
        format!("{} ms", interval(milli * delay.value, milli * SIGMAS_95 * delay.sigma))
    });
    let by_phase = analysis
        .beyond
        .map(|delay| format!("{} ms", interval(milli * delay.seconds, milli * SIGMAS_95 * delay.sigma_s)));
    let linearity = analysis.linearity.as_ref();
    let pairs = [
        ("Judged up to", Some(judged)),
        ("Power that the fit leaves", power),
        ("Fall of the phase", fall),
        ("Delay by the configuration", Some(format!("{:.4} ms", milli * analysis.delay_s))),
        ("Delay beyond it, by the fit", fitted),
        ("Delay beyond it, by the phases", by_phase),
        ("Coherence", linearity.map(|linearity| linearity.whole.words())),
    ];
    pairs.into_iter().filter_map(|(name, text)| Some((name.to_string(), text?))).collect()
}

fn modes(run: &AnalysedRun<'_>) -> String {
    let Ok(fit) = &run.analysis.fit else { return String::new() };
    let header = ["Frequency (Hz)", "Damping (%)", "Residue (1/kg)", "Sign", "Other sign"];
    let rows: String = fit.modes().iter().map(mode).collect();
    section(
        "Modes",
        "Intervals hold the truth with 95 %; beside the sign the probability that it is the other one.",
        &header,
        &rows,
    )
}

fn mode(mode: &FittedMode) -> String {
    let scaled = |e: Estimate, factor: f64| interval(e.value * factor, SIGMAS_95 * e.sigma * factor);
    row(&[
        scaled(mode.omega_rad_s, 1.0 / HERTZ),
        scaled(mode.damping_ratio, 100.0),
        scaled(mode.residue_per_kg, 1.0),
        if mode.sign() == '+' { "+".into() } else { "\u{2212}".into() },
        percent(mode.sign_error_probability()),
    ])
}

fn zeros(run: &AnalysedRun<'_>) -> String {
    let zeros = &run.analysis.verdict.zeros;
    if zeros.is_empty() {
        return String::new();
    }
    let header = ["|s| (Hz)", "Real part (rad/s)", "Imaginary part (rad/s)", "Kind", "Right of the axis"];
    let words = "Of the fit, up to where it is judged; of a conjugate pair the one above the real axis. Intervals hold each part with 95 %.";
    section("Zeros", words, &header, &zeros.iter().map(zero).collect::<String>())
}

fn zero(zero: &UncertainZero) -> String {
    let part = |value: f64, k: usize| interval(value, SIGMAS_95 * zero.covariance[k][k].sqrt());
    row(&[
        format!("{:.3}", zero.s.norm() / HERTZ),
        part(zero.s.re, 0),
        if zero.s.im == 0.0 { "0".into() } else { part(zero.s.im, 1) },
        zero.kind.name().into(),
        percent(zero.rhp_probability),
    ])
}

fn section(heading: &str, words: &str, header: &[&str], rows: &str) -> String {
    format!(
        "<section>\n<h2>{heading}</h2>\n<p class=\"quiet\">{words}</p>\n<div class=\"wide\">{}</div>\n</section>\n",
        table(header, rows)
    )
}

/// What the measured loop dares, beside the model.
fn margins(run: &AnalysedRun<'_>) -> String {
    let Some(closed) = &run.analysis.closed else { return String::new() };
    let (measured, predicted) = (&closed.margins, &closed.predicted);
    let hz = |w: Option<f64>| w.map_or("none in the band".into(), |w| format!("{:.2} Hz", w / HERTZ));
    let deg = |text: Option<String>| text.map_or("none in the band".into(), |text| format!("{text} deg"));
    let known = |e: Estimate| interval(e.value, SIGMAS_95 * e.sigma);
    let header = ["", "Measured", "By the model"];
    let rows = [
        row(&["Crossover".into(), hz(measured.crossover_rad_s), hz(predicted.crossover_rad_s)]),
        row(&[
            "Phase margin".into(),
            deg(measured.phase_margin_deg.map(known)),
            deg(predicted.phase_margin_deg.map(|margin| format!("{margin:.2}"))),
        ]),
        row(&["Modulus margin".into(), known(measured.modulus_margin), format!("{:.4}", predicted.modulus_margin)]),
    ];
    let words = "The phase margin measured is that at the crossover, the one by the model the smallest of all. Intervals hold the truth \
                 with 95 %.";
    section("The closed loop", words, &header, &rows.concat())
}

/// How the loop was scheduled and what it kept.
fn loop_facts(run: &AnalysedRun<'_>) -> String {
    let recording = run.recording;
    let counted = |count: u64| count.to_string();
    let told = ["program", "host", "kernel", "pace", "policy", "memory_locked", "cpu", "refused", "amplifier", "probe"];
    let told = told.map(|name| (capital(name), run.said(name).to_string()));
    let kept = [
        ("Ticks".into(), counted(recording.tick_count())),
        ("Overruns".into(), counted(recording.overruns())),
        ("Lost records".into(), counted(recording.lost_records())),
        ("Ticks filled in".into(), counted(run.analysis.filled_ticks)),
    ];
    let pairs: Vec<_> =
        told.into_iter().filter(|(_, text)| !text.is_empty()).chain(kept).chain(lateness(run)).collect();
    format!("<section>\n<h2>The loop</h2>\n{}</section>\n", facts(&pairs))
}

/// The worst over the run, where there was a clock.
fn lateness(run: &AnalysedRun<'_>) -> Vec<(String, String)> {
    if run.said("pace") == "virtual" {
        return Vec::new();
    }
    let timings = run.recording.timings();
    let worst = |of: fn(&crate::recording::messages::Timing) -> u64| timings.iter().map(of).max().unwrap_or(0);
    let us = |ns: u64| format!("{:.1} us", ns as f64 / 1e3);
    vec![
        ("Latest wake".into(), us(worst(|t| t.lateness_max_ns))),
        ("Longest computation".into(), us(worst(|t| t.compute_max_ns))),
    ]
}

/// `memory_locked` as `Memory locked`.
fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters
        .next()
        .map_or(String::new(), |first| first.to_uppercase().chain(letters).collect::<String>().replace('_', " "))
}

fn configuration(run: &AnalysedRun<'_>) -> String {
    let Some(toml) = run.recording.config_toml() else { return String::new() };
    format!(
        "<section>\n<h2>Configuration</h2>\n<details><summary>{}</summary>\n<pre><code>{}</code></pre>\n</details>\n</section>\n",
        escaped(&run.config.title),
        escaped(toml)
    )
}
