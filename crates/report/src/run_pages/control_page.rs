//! The report of a closed-loop run: its figures, its signals, its error spectrum and the loop by the model.

use super::comparison::step_picture;
use super::page::{named, table_section};
use super::{Plot, run_facts};
use crate::conditions::{joined, lines};
use crate::html::{facts, note, row, section};
use crate::number::{interval, plain};
use crate::{
    LoopPlot, ReportError, SettlingBand, SignalsPlot, error_spectrum_svg, loop_bode_svg,
    loop_nyquist_svg, margin_rows, sensitivity_svg, signals_svg,
};
use bench_config::Config;
use bench_experiment::outputs::PlotKind;
use bench_experiment::{ControlRun, Extent, SineResponse, StepResponse, TrackingMetrics};
use bench_identify::SIGMAS_95;
use bench_recording::Recording;

const SIGNALS_CAPTION: &str =
    "The whole run. Each column reaches from minimum to maximum, so that no spike is left out.";
const STEP_CAPTION: &str =
    "Position from the rest position since the step. The band is 2 % of the step.";
const LOOP_CAPTION: &str =
    "L = P C by the model of the configuration, sampled, with hold, delay and amplifier.";
const NYQUIST_CAPTION: &str = "L by the model in the complex plane. The distance of the curve from -1 is 1/|S|; its smallest value is \
    the modulus margin. Dots are the smallest phase margin and gain margin.";
const SENSITIVITY_CAPTION: &str = "S from reference to error and T from reference to displacement, by the model. The peak of S is \
    the inverse of the modulus margin.";
const MEASURED_SPECTRUM_CAPTION: &str = "Error in the steady state: amplitude spectral density by Welch's method with its 95 % \
    confidence band, and below the RMS up to a frequency.";
const PREDICTED_SPECTRUM_CAPTION: &str = "Beside it the prediction of the simulated stage: disturbance of the floor and noise of \
    the probe, both through S, and the error that the model has with this reference. \"Of the stage itself\" is the error without the \
    reading of the probe: the floor through S and the noise through T.";
const FIGURES_NOTE: &str = "Errors and sine are those of the steady state. A settling time is given if the band of 2 % is above three sigma of the error. ± is the 95 % \
    confidence interval.";

/// A closed-loop run with its recording, for its report.
#[derive(Clone, Copy, Debug)]
pub struct ControlReport<'a> {
    /// The recording.
    pub recording: &'a Recording,
    /// The configuration of the run.
    pub config: &'a Config,
    /// Its analysis.
    pub run: &'a ControlRun,
}

impl ControlReport<'_> {
    /// All plots that the run has data for.
    ///
    /// # Errors
    /// When there is nothing to draw.
    pub fn plots(&self) -> Result<Vec<Plot>, ReportError> {
        let mut plots = vec![self.signals()?];
        if let Some(step) = self.run.measured_step() {
            plots.push(self.step(step)?);
        }
        plots.extend(self.spectrum()?);
        plots.push(self.loop_bode()?);
        plots.push(self.loop_nyquist()?);
        plots.push(self.sensitivity()?);
        Ok(plots)
    }

    /// The page as an HTML document.
    pub fn page(&self, plots: &[Plot]) -> String {
        let title = &self.config.title;
        let body = [
            self.heading(),
            run_facts::ending(self.recording),
            run_facts::command_and_settings(self.recording, self.config),
            self.figures(),
            self.whole_run(),
            plots.iter().map(Plot::section).collect(),
            run_facts::events(self.recording),
            run_facts::scheduling(self.recording, &[]),
            run_facts::configuration(self.recording, title),
        ];
        run_facts::document(self.recording, &self.name(), &body.concat())
    }

    /// The name of the recording without its ending.
    fn name(&self) -> String {
        let stem = self.recording.path().file_stem().unwrap_or_default();
        stem.to_string_lossy().into_owned()
    }

    /// Controller, reference, and the conditions of the run.
    fn subtitle(&self) -> String {
        let (config, control) = (self.config, &self.config.control);
        let controller = format!(
            "{} controller at {} Hz; {}",
            control.controller,
            config.servo.rate_hz,
            control.reference.design().describe(),
        );
        lines(&[&controller, &run_facts::conditions(self.recording, config)])
    }

    fn heading(&self) -> String {
        run_facts::heading(self.recording, &self.config.title, &self.subtitle())
    }

    /// Time of the trip in seconds since the run began.
    fn trip_s(&self) -> Option<f64> {
        let trip = self.run.trip.as_ref()?;
        Some(trip.tick as f64 * self.config.servo.period_s())
    }

    /// Measured and predicted figures of step, steady state and sine.
    fn figures(&self) -> String {
        let mut rows = String::new();
        if let Some(step) = &self.run.step {
            rows += &step_rows(step);
        }
        if let Some(sine) = self.run.sine() {
            rows += &self.sine_rows(&sine);
        }
        if let Some(tracking) = &self.run.tracking {
            rows += &steady_rows(tracking);
        }
        rows += &self.margin_rows();
        table_section(
            "Figures",
            FIGURES_NOTE,
            &["", "Measured", "By the model"],
            &rows,
        )
    }

    fn sine_rows(&self, sine: &SineResponse) -> String {
        let predicted = self.run.predicted_sine;
        let with_sigma = |value: f64, sigma: Option<f64>, digits: usize| match sigma {
            Some(sigma) => interval(value, SIGMAS_95 * sigma),
            None => plain(value, digits),
        };
        let rows = [
            [
                format!("Gain at {} Hz", sine.frequency_hz),
                with_sigma(sine.gain, sine.gain_sigma, 4),
                or_none(predicted.map(|sine| plain(sine.gain, 5))),
            ],
            [
                "Phase (deg)".into(),
                with_sigma(sine.phase_deg, sine.phase_sigma_deg, 2),
                or_none(predicted.map(|sine| plain(sine.phase_deg, 3))),
            ],
            [
                "RMS beside the sine (µm)".into(),
                um(sine.residual_rms_m),
                String::new(),
            ],
        ];
        rows.iter().map(|cells| row(cells)).collect()
    }

    fn margin_rows(&self) -> String {
        let margins = &self.run.model.margins;
        if !margins.stable {
            return row(&["Closed loop".into(), String::new(), "unstable".into()]);
        }
        let rows = margin_rows(margins).into_iter();
        let rows = rows.map(|(name, value)| row(&[capital(name), String::new(), or_none(value)]));
        rows.collect()
    }

    /// Largest values and heat.
    fn whole_run(&self) -> String {
        let figures = &self.run.figures;
        let heat_percent = 100.0 * (figures.thermal_peak_a / figures.thermal_limit_a).powi(2);
        let pairs = named([
            (
                "Largest error",
                Some(format!("{} µm", um(figures.peak_error_m))),
            ),
            (
                "RMS of the error",
                Some(format!("{} µm", um(figures.rms_error_m))),
            ),
            (
                "Peak current",
                Some(format!("{:.4} A", figures.peak_current_a)),
            ),
            (
                "RMS current",
                Some(format!("{:.4} A", figures.rms_current_a)),
            ),
            (
                "Heat of the motor",
                Some(format!(
                    "at most {heat_percent:.2} % of the limit of the interlock"
                )),
            ),
        ]);
        section(
            "Whole run",
            &(note("From the tick on in which the loop closed.") + &facts(&pairs)),
        )
    }

    fn signals(&self) -> Result<Plot, ReportError> {
        let overview = &self.run.overview;
        let [reference, position, error, current] = [
            &overview.reference_m,
            &overview.position_m,
            &overview.error_m,
            &overview.current_a,
        ]
        .map(|extents| envelope(extents));
        let plot = SignalsPlot {
            reference: &reference,
            position: &position,
            error: &error,
            current: &current,
            band: self.run.step.as_ref().map(|step| self.settling_band(step)),
            trip_s: self.trip_s(),
        };
        let svg = signals_svg(&plot, &self.config.title, &self.subtitle())?;
        let band = self
            .run
            .step
            .as_ref()
            .map(|_| " The band is 2 % of the step.");
        let trip = self
            .run
            .trip
            .as_ref()
            .map(|trip| format!(" The dashed line is the trip: {}.", trip.text));
        let caption = [
            SIGNALS_CAPTION,
            band.unwrap_or_default(),
            &trip.unwrap_or_default(),
        ]
        .concat();
        Ok(Plot::new(PlotKind::Signals, caption, svg))
    }

    fn settling_band(&self, step: &StepResponse) -> SettlingBand {
        SettlingBand {
            from_s: self.run.closed_at_s + step.at_s,
            target_m: step.rest_m + step.height_m,
            half_m: 0.02 * step.height_m.abs(),
        }
    }

    fn step(&self, step: &StepResponse) -> Result<Plot, ReportError> {
        let svg = step_picture(step, &self.config.title)?;
        Ok(Plot::new(PlotKind::Step, STEP_CAPTION, svg))
    }

    fn spectrum(&self) -> Result<Option<Plot>, ReportError> {
        let Some(spectrum) = &self.run.spectrum else {
            return Ok(None);
        };
        let svg = error_spectrum_svg(spectrum, &self.config.title, &self.subtitle())?;
        let caption = match spectrum.predicted {
            Some(_) => format!("{MEASURED_SPECTRUM_CAPTION} {PREDICTED_SPECTRUM_CAPTION}"),
            None => MEASURED_SPECTRUM_CAPTION.into(),
        };
        Ok(Some(Plot::new(PlotKind::Spectrum, caption, svg)))
    }

    fn loop_bode(&self) -> Result<Plot, ReportError> {
        let svg = loop_bode_svg(
            &LoopPlot::from(&self.run.model),
            &self.config.title,
            &self.loop_subtitle(),
        )?;
        Ok(Plot::new(PlotKind::Loop, LOOP_CAPTION, svg))
    }

    fn loop_nyquist(&self) -> Result<Plot, ReportError> {
        let svg = loop_nyquist_svg(
            &LoopPlot::from(&self.run.model),
            &self.config.title,
            &self.loop_subtitle(),
        )?;
        Ok(Plot::new(PlotKind::LoopNyquist, NYQUIST_CAPTION, svg))
    }

    fn sensitivity(&self) -> Result<Plot, ReportError> {
        let svg = sensitivity_svg(
            &LoopPlot::from(&self.run.model),
            &self.config.title,
            &self.loop_subtitle(),
        )?;
        Ok(Plot::new(PlotKind::Sensitivity, SENSITIVITY_CAPTION, svg))
    }

    /// The subtitle of the plots of the model.
    fn loop_subtitle(&self) -> String {
        let stability = if self.run.model.margins.stable {
            "stable"
        } else {
            "UNSTABLE"
        };
        joined(&[&format!("{stability} by the model"), &self.subtitle()])
    }
}

fn envelope(extents: &[Extent]) -> Vec<(f64, f64, f64)> {
    let extents = extents.iter();
    extents.map(|e| (e.time_s, e.min, e.max)).collect()
}

fn step_rows(step: &StepResponse) -> String {
    let measured = step.metrics.and_then(|metrics| metrics.step);
    let predicted = step.predicted.as_ref().map(|predicted| predicted.metrics);
    let ms = |seconds: Option<f64>| or_none(seconds.map(|s| format!("{:.1}", s * 1e3)));
    let percent = |value: Option<f64>| or_none(value.map(|value| plain(value, 1)));
    let rows = [
        [
            "Height of the step (µm)".into(),
            format!("{:.3}", step.height_m * 1e6),
            String::new(),
        ],
        [
            "Settling to 2 % (ms)".into(),
            ms(measured.and_then(|step| step.settling_time_s)),
            ms(predicted.and_then(|step| step.settling_time_s)),
        ],
        [
            "Overshoot (%)".into(),
            percent(measured.map(|step| step.overshoot_percent)),
            percent(predicted.map(|step| step.overshoot_percent)),
        ],
    ];
    rows.iter().map(|cells| row(cells)).collect()
}

/// The error in the steady state. That of a sine is the part that follows from its gain and phase.
fn steady_rows(tracking: &TrackingMetrics) -> String {
    let rows = [
        ("Mean error (µm)", tracking.steady_state_mean_error_m),
        ("Sigma of the error (µm)", tracking.steady_state_sigma_m),
        ("RMS of the error (µm)", tracking.steady_state_rms_m),
    ];
    rows.map(|(name, metres)| row(&[name.into(), um(metres), String::new()]))
        .concat()
}

/// Metres in micrometres, with four decimals.
fn um(metres: f64) -> String {
    plain(metres * 1e6, 4)
}

fn or_none(text: Option<String>) -> String {
    text.unwrap_or_else(|| "none".into())
}

/// A name at the beginning of a row.
fn capital(name: &str) -> String {
    let mut letters = name.chars();
    let first = letters.next().map(|first| first.to_ascii_uppercase());
    first.into_iter().chain(letters).collect()
}
