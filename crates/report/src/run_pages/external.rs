//! The report of an external record: without model and loop.

use super::RecordReport;
use super::distortion_plot::distortion_plot;
use super::page::{delay_ms, named};
use crate::html::{facts, section};
use crate::{MagnitudeAxis, ReportError};
use bench_external::TimeBase;
use bench_identify::modal::{InputPath, ModalFit};
use bench_identify::record_check::Correction;
use bench_identify::{ExternalAnalysis, FittedLag, OutputKind, StaticSign, Unit};

/// An analysed table of samples.
#[derive(Clone, Copy, Debug)]
pub struct ExternalRecord<'a> {
    /// Its analysis.
    pub analysis: &'a ExternalAnalysis,
    /// Name of the file.
    pub file: &'a str,
    /// Column of the input.
    pub input: &'a str,
    /// Column of the output.
    pub output: &'a str,
    /// Column of the reference of a closed loop.
    pub reference: Option<&'a str>,
    /// Samples per second.
    pub rate_hz: f64,
    /// Number of samples.
    pub samples: usize,
    /// The times of the file.
    pub times: TimeBase,
    /// Axis of the magnitudes.
    pub magnitude_axis: MagnitudeAxis,
}

impl<'a> ExternalRecord<'a> {
    /// The report of the record.
    ///
    /// # Errors
    /// When there is nothing to draw.
    pub fn report(&self) -> Result<RecordReport<'a>, ReportError> {
        let (analysis, input, output) = (self.analysis, self.input, self.output);
        let fit = analysis.fit.as_ref().ok();
        let subtitle = format!("{input} to {output}, in the units of the columns");
        let linearity = analysis
            .periodic
            .as_ref()
            .and_then(|part| part.linearity.as_ref());
        let plot =
            linearity.map(|linearity| distortion_plot(linearity, output, self.file, &subtitle));
        Ok(RecordReport {
            name: None,
            ending: String::new(),
            command_and_settings: String::new(),
            title: self.file.to_string(),
            subtitle,
            record: format!("{} samples at {} Hz", self.samples, self.rate_hz),
            unit: Unit::Bare,
            residue_unit: self.residue_unit(),
            frf: &analysis.frf,
            model: None,
            magnitude_axis: self.magnitude_axis,
            chain: analysis.chain.clone(),
            fit,
            signs: None,
            verdict: &analysis.verdict,
            judged_up_to_rad_s: analysis.judged_up_to_rad_s,
            evidence: named([(
                "Delay by the fit",
                fit.and_then(ModalFit::determined_delay_s).map(delay_ms),
            )]),
            further_plots: plot.transpose()?.into_iter().collect(),
            before_plots: String::new(),
            after_plots: self.description(),
        })
    }

    /// The unit of the residues, in which a position is the output divided by s or s^2.
    fn residue_unit(&self) -> String {
        let (input, output) = (self.input, self.output);
        match self.analysis.output_kind {
            OutputKind::Position => format!("{output} per {input} and s^2"),
            OutputKind::Velocity => format!("{output} per {input} and s"),
            OutputKind::Acceleration => format!("{output} per {input}"),
        }
    }

    /// An inverted sensor or drive.
    fn static_sign(&self) -> Option<String> {
        let sign = self.analysis.static_sign();
        sign.and_then(StaticSign::description).map(String::from)
    }

    fn description(&self) -> String {
        let periodic = self.analysis.periodic.as_ref();
        let pairs = named([
            ("Input", Some(self.input.to_string())),
            ("Output", Some(self.output.to_string())),
            (
                "Reference of the closed loop",
                self.reference.map(String::from),
            ),
            (
                "Kind of the input",
                self.analysis.input_kind.map(|kind| kind.name().to_string()),
            ),
            (
                "Kind of the output",
                Some(self.analysis.output_kind.name().to_string()),
            ),
            ("Sign", self.static_sign()),
            ("Samples", Some(self.samples.to_string())),
            ("Rate", Some(format!("{} Hz", self.rate_hz))),
            ("Times", Some(self.times.to_string())),
            ("Resolution", self.analysis.resolution.description()),
            (
                "Readings",
                self.analysis.readings_fit.map(|fit| fit.description()),
            ),
            (
                "Corrected",
                Correction::description(&self.analysis.corrections),
            ),
            (
                "Clocks",
                self.analysis.clock_skew.map(|skew| skew.description()),
            ),
            (
                "Hold of the input",
                milliseconds(self.analysis.input_path.hold_s),
            ),
            (
                "Lag of the input",
                lag_text(self.analysis.input_path, self.analysis.fitted_lag),
            ),
            (
                "Periods averaged",
                periodic.map(|part| part.periods.to_string()),
            ),
            (
                "Periods skipped before",
                periodic.map(|part| part.skipped.to_string()),
            ),
            (
                "Distortion",
                periodic
                    .and_then(|part| part.distortion)
                    .map(|distortion| distortion.description()),
            ),
        ]);
        section("The record", &facts(&pairs))
    }
}

/// The lag of an input, with its interval if it was fitted; `None` without one.
pub(super) fn lag_text(path: InputPath, fitted: Option<FittedLag>) -> Option<String> {
    let text = milliseconds(path.lag_s)?;
    Some(match fitted {
        None => text,
        Some(FittedLag { lag_s }) => {
            format!("{text}, fitted, ± {:.4} ms", 1e3 * lag_s.half_width_95())
        }
    })
}

/// A time in milliseconds; `None` if it is 0.
pub(super) fn milliseconds(time_s: f64) -> Option<String> {
    (time_s > 0.0).then(|| format!("{:.4} ms", 1e3 * time_s))
}
