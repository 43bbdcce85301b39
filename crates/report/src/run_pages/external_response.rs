//! The report of a frequency response of another program: without samples, model and loop.

use super::RecordReport;
use super::external::{lag_text, milliseconds};
use super::page::{delay_ms, named};
use crate::MagnitudeAxis;
use crate::html::{facts, section};
use bench_experiment::ExternalResponse;
use bench_identify::Unit;
use bench_identify::modal::ModalFit;
use bench_identify::{ResponseAnalysis, scatter::SigmaSource};

/// An analysed frequency response.
#[derive(Clone, Copy, Debug)]
pub struct ResponseReport<'a> {
    /// The response as it was read.
    pub response: &'a ExternalResponse,
    /// Its analysis.
    pub analysis: &'a ResponseAnalysis,
    /// Name of the file.
    pub file: &'a str,
    /// Axis of the magnitudes.
    pub magnitude_axis: MagnitudeAxis,
}

impl<'a> ResponseReport<'a> {
    /// The report of the response.
    pub fn report(&self) -> RecordReport<'a> {
        let analysis = self.analysis;
        let fit = analysis.fit.as_ref().ok();
        let unit = self.response.unit();
        let (low_hz, high_hz) = analysis.band_hz;
        let frequencies = analysis.frf.len();
        RecordReport {
            name: None,
            ending: String::new(),
            command_and_settings: String::new(),
            title: self.file.to_string(),
            subtitle: format!("response of another program, in {unit}"),
            record: format!("{frequencies} frequencies from {low_hz:.4} to {high_hz:.4} Hz"),
            unit: Unit::Bare,
            residue_unit: unit.of_residue(analysis.output_kind),
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
            further_plots: Vec::new(),
            before_plots: String::new(),
            after_plots: self.description(),
        }
    }

    fn description(&self) -> String {
        let (response, analysis) = (self.response, self.analysis);
        let negative = response.negative.map(|found| found.description());
        let assumptions = response.assumptions.join("; ");
        let pairs = named([
            ("Unit", Some(response.unit().to_string())),
            (
                "Kind of the input",
                analysis.input_kind.map(|kind| kind.name().to_string()),
            ),
            ("Output", Some(analysis.output_kind.name().to_string())),
            ("Points of the file", Some(response.frf.len().to_string())),
            (
                "Points with independent errors",
                Some(analysis.frf.data.len().to_string()),
            ),
            (
                "Standard deviations",
                Some(sigma_name(response.sigma).into()),
            ),
            ("Sign", negative),
            (
                "Assumptions",
                Some(assumptions).filter(|text| !text.is_empty()),
            ),
            (
                "Hold of the input",
                milliseconds(analysis.input_path.hold_s),
            ),
            (
                "Lag of the input",
                lag_text(analysis.input_path, analysis.fitted_lag),
            ),
        ]);
        section("The response", &facts(&pairs))
    }
}

fn sigma_name(sigma: SigmaSource) -> &'static str {
    match sigma {
        SigmaSource::Estimated => "estimated from the scatter over neighbouring frequencies",
        _ => "those of the file",
    }
}
