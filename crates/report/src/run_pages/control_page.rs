//! The report of a closed-loop run: its figures, its signals, its error spectrum and the loop by the model.

use super::comparison::step_picture;
use super::page::table_section;
use super::{Plot, run_facts};
use crate::conditions::{joined, lines};
use crate::figures::{Figure, control_table, whole_run};
use crate::html::{facts, note, section};
use crate::{
    LoopPlot, ReportError, SettlingBand, SignalsPlot, error_spectrum_svg, loop_bode_svg,
    loop_nyquist_svg, sensitivity_svg, signals_svg,
};
use bench_config::Config;
use bench_experiment::outputs::PlotKind;
use bench_experiment::{ControlRun, Extent, StepResponse};
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
        table_section("Figures", FIGURES_NOTE, &control_table(self.run))
    }

    /// Largest values and heat.
    fn whole_run(&self) -> String {
        let figures = whole_run(&self.run.figures);
        let pairs: Vec<(String, String)> = figures.iter().map(Figure::pair).collect();
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
