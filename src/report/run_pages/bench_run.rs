//! A run of the bench: its model, its loop, its scheduling.

use nalgebra::Complex;

use super::page::{delay_ms, section};
use super::{Plot, ReportSource, Shown};
use crate::config::Config;
use crate::excitation::{swept_words, words};
use crate::experiment::{Analysis, ClosedResponses};
use crate::identify::Unit;
use crate::identify::linearity::Linearity;
use crate::identify::modal::{Estimate, MeasurementChain, SIGMAS_95};
use crate::recording::Recording;
use crate::report::number::interval;
use crate::report::page::{escaped, facts, row};
use crate::report::{Curve, LevelLines, ReportError, Trace, bode_svg, levels_svg};

const HERTZ: f64 = 2.0 * std::f64::consts::PI;

/// A run that was analysed.
#[derive(Clone, Copy, Debug)]
pub struct RunReport<'a> {
    /// What it shows.
    pub analysis: &'a Analysis,
    /// What it was made with.
    pub config: &'a Config,
    /// Where it was recorded.
    pub recording: &'a Recording,
}

impl RunReport<'_> {
    /// What was excited, and when, in two lines.
    fn subtitle(&self) -> String {
        format!(
            "current set-point to displacement, with hold, amplifier and delay;\n{}",
            self.occasion()
        )
    }

    /// How the stage was excited, and when.
    fn occasion(&self) -> String {
        let how = match self.analysis.closed {
            Some(_) => swept_words(self.config),
            None => words(self.config),
        };
        format!(
            "{how} at {} Hz; {}",
            self.config.servo.rate_hz,
            self.said("started")
        )
    }

    /// What the recording says of itself under a name.
    fn said(&self, name: &str) -> &str {
        self.recording
            .metadata()
            .get(name)
            .map_or("", String::as_str)
    }
}

impl ReportSource for RunReport<'_> {
    fn shown(&self) -> Shown<'_> {
        Shown {
            title: self.config.title.clone(),
            subtitle: self.subtitle(),
            unit: Unit::MetresPerAmpere,
            residue_unit: "1/kg".into(),
            frf: &self.analysis.frf,
            model: Some(&self.analysis.model),
            chain: MeasurementChain::bench(self.config),
            fit: self.analysis.fit.as_ref().ok(),
            verdict: &self.analysis.verdict,
            judged_up_to_rad_s: self.analysis.judged_up_to_rad_s,
        }
    }

    fn record(&self) -> String {
        format!(
            "Recording {}",
            self.recording
                .path()
                .file_name()
                .unwrap_or_default()
                .to_string_lossy()
        )
    }

    fn evidence(&self) -> Vec<(String, String)> {
        let analysis = self.analysis;
        let fitted = analysis
            .fit
            .as_ref()
            .ok()
            .map(|fit| delay_ms(fit.delay_s()));
        let by_phase = analysis.excess_delay.map(delay_ms);
        let linearity = analysis.linearity.as_ref();
        let pairs = [
            (
                "Delay by the configuration",
                Some(format!("{:.4} ms", 1e3 * analysis.delay_s)),
            ),
            ("Delay beyond it, by the fit", fitted),
            ("Delay beyond it, by the phases", by_phase),
            (
                "Coherence",
                linearity.map(|linearity| linearity.why.clone()),
            ),
        ];
        pairs
            .into_iter()
            .filter_map(|(name, text)| Some((name.to_string(), text?)))
            .collect()
    }

    fn more_pictures(&self) -> Result<Vec<Plot>, ReportError> {
        let mut all = Vec::new();
        if let Some(closed) = &self.analysis.closed {
            all.extend(around(self, closed)?);
        }
        if let Some(linearity) = &self.analysis.linearity {
            all.push(levels(self, linearity)?);
        }
        Ok(all)
    }

    fn sections(&self) -> (String, String) {
        (margins(self), loop_facts(self) + &configuration(self))
    }
}

/// The loop and its sensitivities, measured over model.
fn around(run: &RunReport<'_>, closed: &ClosedResponses) -> Result<[Plot; 2], ReportError> {
    let frequency_hz = &closed.loop_gain.frequency_hz;
    let by_model = |of: fn(Complex<f64>) -> Complex<f64>| {
        closed.model_loop.iter().map(|l| of(*l)).collect::<Vec<_>>()
    };
    let (sensitivity, complementary) = (by_model(|l| (l + 1.0).inv()), by_model(|l| l / (l + 1.0)));
    let measured = |name, frf| Trace {
        name,
        curve: Curve::Measured(frf),
    };
    let model = |name, response| Trace {
        name,
        curve: Curve::Model {
            frequency_hz,
            response,
        },
    };
    let picture = |kind, heading, caption: &str, traces: &[Trace]| {
        let subtitle = format!(
            "the loop as sampled, with hold, amplifier and delay;\n{}",
            run.occasion()
        );
        let svg = bode_svg(Unit::Bare, traces, &run.config.title, &subtitle)?;
        Ok(Plot {
            kind,
            heading,
            caption: caption.into(),
            svg,
        })
    };
    Ok([
        picture(
            "loop",
            "Loop",
            "L = P C from error to displacement, measured with its band of two sigma, and by the model.",
            &[
                measured("L measured", &closed.loop_gain),
                model("L by the model", &closed.model_loop),
            ],
        )?,
        picture(
            "sensitivity",
            "Sensitivities",
            "S from reference to error and T from reference to displacement. The peak of S is the inverse of the modulus margin.",
            &[
                measured("S measured", &closed.sensitivity),
                measured("T measured", &closed.complementary),
                model("S by the model", &sensitivity),
                model("T by the model", &complementary),
            ],
        )?,
    ])
}

/// Output, noise and distortion, line by line.
fn levels(run: &RunReport<'_>, linearity: &Linearity) -> Result<Plot, ReportError> {
    let harmonics = &linearity.harmonics;
    let periods = harmonics.periods;
    let lines = LevelLines {
        output: &harmonics.excited,
        odd: &harmonics.odd,
        even: &harmonics.even,
        periods,
    };
    Ok(Plot {
        kind: "linearity",
        heading: "Distortion and noise",
        caption: format!(
            "RMS of the displacement a line, of the mean of {periods} periods: at the lines that were excited, and at the odd and even \
             ones that were left out, averaged over neighbours. Without distortion these lie on the noise of the mean. {}.",
            linearity.why.clone()
        ),
        svg: levels_svg(&lines, &run.config.title, &run.subtitle())?,
    })
}

/// What the measured loop dares, beside the model.
fn margins(run: &RunReport<'_>) -> String {
    let Some(closed) = &run.analysis.closed else {
        return String::new();
    };
    let (measured, predicted) = (&closed.margins, &closed.predicted);
    let hz = |w: Option<f64>| {
        w.map_or("none in the band".into(), |w| {
            format!("{:.2} Hz", w / HERTZ)
        })
    };
    let deg =
        |text: Option<String>| text.map_or("none in the band".into(), |text| format!("{text} deg"));
    let known = |e: Estimate| interval(e.value, SIGMAS_95 * e.sigma);
    let header = ["", "Measured", "By the model"];
    let rows = [
        row(&[
            "Crossover".into(),
            hz(measured.crossover_rad_s),
            hz(predicted.crossover_rad_s),
        ]),
        row(&[
            "Phase margin".into(),
            deg(measured.phase_margin_deg.map(known)),
            deg(predicted
                .phase_margin_deg
                .map(|margin| format!("{margin:.2}"))),
        ]),
        row(&[
            "Modulus margin".into(),
            known(measured.modulus_margin),
            format!("{:.4}", predicted.modulus_margin),
        ]),
    ];
    let words = "The phase margin measured is that at the crossover, the one by the model the smallest of all. Intervals hold the truth \
                 with 95 %.";
    section("The closed loop", words, &header, &rows.concat())
}

/// How the loop was scheduled and what it kept.
fn loop_facts(run: &RunReport<'_>) -> String {
    let recording = run.recording;
    let counted = |count: u64| count.to_string();
    let told = [
        "program",
        "host",
        "kernel",
        "pace",
        "policy",
        "memory_locked",
        "cpu",
        "refused",
        "amplifier",
        "probe",
    ];
    let told = told.map(|name| (capital(name), run.said(name).to_string()));
    let kept = [
        ("Ticks".into(), counted(recording.tick_count())),
        ("Overruns".into(), counted(recording.overruns())),
        ("Lost records".into(), counted(recording.lost_records())),
        ("Ticks filled in".into(), counted(run.analysis.filled_ticks)),
    ];
    let pairs: Vec<_> = told
        .into_iter()
        .filter(|(_, text)| !text.is_empty())
        .chain(kept)
        .chain(lateness(run))
        .collect();
    format!(
        "<section>\n<h2>The loop</h2>\n{}</section>\n",
        facts(&pairs)
    )
}

/// The worst over the run, where there was a clock.
fn lateness(run: &RunReport<'_>) -> Vec<(String, String)> {
    if run.said("pace") == "virtual" {
        return Vec::new();
    }
    let timings = run.recording.timings();
    let worst = |of: fn(&crate::recording::messages::Timing) -> u64| {
        timings.iter().map(of).max().unwrap_or(0)
    };
    let us = |ns: u64| format!("{:.1} us", ns as f64 / 1e3);
    vec![
        ("Latest wake".into(), us(worst(|t| t.lateness_max_ns))),
        (
            "Longest computation".into(),
            us(worst(|t| t.compute_max_ns)),
        ),
    ]
}

/// `memory_locked` as `Memory locked`.
fn capital(name: &str) -> String {
    let mut letters = name.chars();
    letters.next().map_or(String::new(), |first| {
        first
            .to_uppercase()
            .chain(letters)
            .collect::<String>()
            .replace('_', " ")
    })
}

fn configuration(run: &RunReport<'_>) -> String {
    let Some(toml) = run.recording.config_toml() else {
        return String::new();
    };
    format!(
        "<section>\n<h2>Configuration</h2>\n<details><summary>{}</summary>\n<pre><code>{}</code></pre>\n</details>\n</section>\n",
        escaped(&run.config.title),
        escaped(toml)
    )
}
