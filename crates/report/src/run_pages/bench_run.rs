//! The report of a run of the bench: with its model, its loop, its scheduling and its configuration.

use super::distortion_plot::distortion_plot;
use super::loop_pictures::MeasuredLoop;
use super::page::{delay_ms, named, table_section};
use super::{Plot, RecordReport, run_facts};
use crate::conditions::lines;
use crate::number::significant;
use crate::{MagnitudeAxis, ReportError, figures};
use bench_config::Config;
use bench_excitation::AmplitudeCurve;
use bench_experiment::outputs::PlotKind;
use bench_experiment::{Analysis, ClosedResponses, Description};
use bench_identify::Unit;
use bench_identify::modal::MeasurementChain;
use bench_recording::Recording;

const LOOP_CAPTION: &str = "L = P C from error to displacement: measured, with a band of two sigma, and by the model. Dotted: |L| = 1 \
    and -180 degrees.";
const LOOP_NYQUIST_CAPTION: &str = "L in the complex plane around -1, with frequencies. The distance of the curve from -1 is 1/|S|; \
    circles are 95 % confidence regions.";
const SENSITIVITY_CAPTION: &str = "S from reference to error and T from reference to displacement. The peak of S is the inverse \
    of the modulus margin.";
const SENSITIVITY_LIMIT_CAPTION: &str =
    " Dashed: the limit of |S|, the inverse of the least allowed modulus margin.";
const MARGINS_NOTE: &str = "The phase margin is the smallest one of all crossings of |L| = 1. ± is the 95 % confidence interval.";

const MA_PER_A: f64 = 1e3;
/// Significant digits of an amplitude.
const DIGITS: usize = 3;

/// An analysed run.
#[derive(Clone, Debug)]
pub struct BenchRun<'a> {
    /// Its analysis.
    analysis: &'a Analysis,
    recording: &'a Recording,
    /// The configuration with which it ran.
    config: &'a Config,
    /// The signal path between set-point and reading, without the mechanics.
    chain: MeasurementChain,
    /// Title of the configuration.
    title: String,
    /// How the stage was excited.
    excitation: String,
    /// Ticks per second.
    rate_hz: f64,
    magnitude_axis: MagnitudeAxis,
}

impl<'a> BenchRun<'a> {
    /// A run with its analysis and the configuration that it ran with.
    pub fn new(
        recording: &'a Recording,
        analysis: &'a Analysis,
        config: &'a Config,
    ) -> BenchRun<'a> {
        BenchRun {
            analysis,
            recording,
            config,
            chain: MeasurementChain::bench(config),
            title: config.title.clone(),
            excitation: match analysis.closed {
                Some(_) => config.swept_reference_text(),
                None => config.excitation_text(),
            },
            rate_hz: config.servo.rate_hz,
            magnitude_axis: MagnitudeAxis::default(),
        }
    }

    /// The run of the last of several shots, with the analysis of all of them. `excitation` describes the shots.
    pub fn of_shots(self, excitation: String) -> BenchRun<'a> {
        BenchRun { excitation, ..self }
    }

    /// The same run, with this axis for the magnitudes of its responses.
    pub fn with_magnitude_axis(self, magnitude_axis: MagnitudeAxis) -> BenchRun<'a> {
        BenchRun {
            magnitude_axis,
            ..self
        }
    }

    /// The report of the run.
    ///
    /// # Errors
    /// When a response is invalid.
    pub fn report(&self) -> Result<RecordReport<'a>, ReportError> {
        let analysis = self.analysis;
        Ok(RecordReport {
            name: Description::of(self.recording).name,
            title: self.title.clone(),
            subtitle: self
                .subtitle("current set-point to displacement, with hold, amplifier and delay"),
            record: run_facts::record(self.recording),
            unit: Unit::MetresPerAmpere,
            residue_unit: "1/kg".into(),
            frf: &analysis.frf,
            model: Some(&analysis.model_response),
            magnitude_axis: self.magnitude_axis,
            chain: self.chain.clone(),
            fit: analysis.fit.as_ref().ok(),
            signs: analysis.signs.as_ref(),
            verdict: &analysis.verdict,
            judged_up_to_rad_s: analysis.judged_up_to_rad_s,
            evidence: evidence(analysis),
            further_plots: self.further_plots()?,
            ending: run_facts::ending(self.recording),
            command_and_settings: run_facts::command_and_settings(self.recording, self.config),
            before_plots: analysis.closed.as_ref().map_or_else(String::new, margins),
            after_plots: run_facts::events(self.recording)
                + &self.scheduling()
                + &run_facts::configuration(self.recording, &self.title),
        })
    }

    /// The content of a plot, the excitation with its amplitude, and the conditions of the run.
    fn subtitle(&self, shown: &str) -> String {
        let (excitation, rate_hz) = (&self.excitation, self.rate_hz);
        let amplitude = self.amplitude().unwrap_or_default();
        let conditions = run_facts::conditions(self.recording, self.config);
        let excitation = format!("{excitation} at {rate_hz} Hz{amplitude}");
        lines(&[shown, &excitation, &conditions])
    }

    /// The amplitude of an excitation in open loop: one, or the smallest and the largest within its band. All frequencies of a
    /// multisine together reach the largest one.
    fn amplitude(&self) -> Option<String> {
        let chosen = self.config.chosen_excitation().ok()?;
        if self.analysis.closed.is_some() || !chosen.design.has_amplitude_curve() {
            return None;
        }
        let chirp = &self.config.chirp;
        let (low_hz, high_hz) = chirp.band_hz();
        let (low_a, high_a) = AmplitudeCurve::of_current(&chirp.amplitude).range(low_hz, high_hz);
        let [low_ma, high_ma] = [low_a, high_a].map(|a| significant(MA_PER_A * a, DIGITS));
        Some(match (chosen.design.is_broadband(), low_ma == high_ma) {
            (true, _) => format!(", at most {high_ma} mA"),
            (false, true) => format!(", {high_ma} mA"),
            (false, false) => format!(", {low_ma} to {high_ma} mA"),
        })
    }

    fn further_plots(&self) -> Result<Vec<Plot>, ReportError> {
        let mut plots = Vec::new();
        if let Some(closed) = &self.analysis.closed {
            plots.extend(self.loop_plots(closed)?);
        }
        if let Some(linearity) = &self.analysis.linearity {
            let subtitle = self.subtitle("displacement by frequency");
            let plot = distortion_plot(linearity, "Displacement (m)", &self.title, &subtitle)?;
            plots.push(plot);
        }
        Ok(plots)
    }

    /// L as Bode plot and Nyquist plot, S and T.
    fn loop_plots(&self, closed: &ClosedResponses) -> Result<[Plot; 3], ReportError> {
        let min_modulus_margin = self.config.control.min_modulus_margin;
        let subtitle = self.subtitle("the sampled loop, with hold, amplifier and delay");
        let [bode, nyquist, sensitivities] = MeasuredLoop {
            loop_gain: &closed.loop_gain,
            sensitivity: &closed.sensitivity,
            complementary: &closed.complementary,
            model: &closed.model_loop,
            margins: Some(&closed.margins),
            min_modulus_margin,
            title: &self.title,
            subtitle: &subtitle,
        }
        .pictures()?;
        let caption = sensitivity_caption(min_modulus_margin);
        Ok([
            Plot::new(PlotKind::Loop, LOOP_CAPTION, bode),
            Plot::new(PlotKind::LoopNyquist, LOOP_NYQUIST_CAPTION, nyquist),
            Plot::new(PlotKind::Sensitivity, caption, sensitivities),
        ])
    }

    fn scheduling(&self) -> String {
        let filled = self.analysis.filled_ticks.to_string();
        run_facts::scheduling(
            self.recording,
            &[("Missing ticks filled in".into(), filled)],
        )
    }
}

/// A least allowed modulus margin of 0 is none, and no limit is drawn.
fn sensitivity_caption(min_modulus_margin: f64) -> String {
    let limit = if min_modulus_margin > 0.0 {
        SENSITIVITY_LIMIT_CAPTION
    } else {
        ""
    };
    [SENSITIVITY_CAPTION, limit].concat()
}

fn evidence(analysis: &Analysis) -> Vec<(String, String)> {
    let configured = format!("{:.4} ms", 1e3 * analysis.delay_s);
    let fitted = analysis
        .fit
        .as_ref()
        .ok()
        .map(|fit| delay_ms(fit.delay_s()));
    let by_phase = analysis.excess_delay.map(delay_ms);
    let linearity = analysis.linearity.as_ref();
    let coherence = linearity.map(|linearity| linearity.why.clone());
    named([
        ("Delay of the configuration", Some(configured)),
        ("Excess delay by the fit", fitted),
        ("Excess delay by the phases", by_phase),
        ("Coherence", coherence),
    ])
}

/// Measured and predicted margins of the closed loop.
fn margins(closed: &ClosedResponses) -> String {
    let measured = figures::measured_margins(&closed.margins);
    let predicted = figures::margins(&closed.predicted);
    let table = figures::beside(&measured, &predicted);
    table_section("The closed loop", MARGINS_NOTE, &table)
}
