//! The overview of the runs of one excitation at several amplitudes.

use serde::Serialize;

use super::page_error::PageError;
use crate::{AmplitudeOverview, Picture, amplitudes_svg, joined, plant_conditions};
use bench_config::Config;
use bench_experiment::linearity::ModeOverAmplitude;
use bench_experiment::outputs::{AnalysisOutputs, AnalysisStatus, ResultFiles};

const CAPTION: &str = "Frequency and compliance of the modes in the excited band relative to the smallest amplitude, and their \
    damping ratios, each with its 95 % confidence interval: those of a linear stage do not depend on the amplitude. Noise of one \
    period and distortion over the whole band, as ratios of the amplitude of the output. The mean power of the noise is subtracted \
    from that of the distortion; where nothing remains, no point is drawn.";

/// The files of an overview; the names in JSON must not change.
#[derive(Clone, Debug, Serialize)]
pub struct AmplitudeFiles {
    /// The picture.
    pub plot: String,
    /// The page.
    pub report: String,
}

impl AmplitudeFiles {
    /// Draws the modes and the distortion over the amplitude, and writes them as a picture and a page; `None` unless two runs were
    /// analysed. `runs` are the amplitudes as ratios of the planned one, rising, with the results; `modes` are those of all runs.
    ///
    /// # Errors
    /// When the overview cannot be drawn, or a file cannot be written.
    pub fn write(
        runs: &[(f64, &AnalysisOutputs)],
        modes: &[ModeOverAmplitude],
        config: &Config,
        results: ResultFiles<'_>,
    ) -> Result<Option<AmplitudeFiles>, PageError> {
        // No run follows one that was not analysed.
        let is_analysed = |outputs: &AnalysisOutputs| outputs.status == AnalysisStatus::Analysed;
        let analysed = runs.iter().take_while(|(_, outputs)| is_analysed(outputs));
        let (scales, linearity): (Vec<f64>, Vec<_>) = analysed
            .map(|(scale, outputs)| (*scale, outputs.linearity.as_ref()))
            .unzip();
        if scales.len() < 2 {
            return Ok(None);
        }
        let overview = AmplitudeOverview {
            scales: &scales,
            modes,
            linearity: &linearity,
        };
        let title = format!("{}: {} amplitudes", config.title, scales.len());
        let picture = Picture {
            svg: amplitudes_svg(&overview, &title, &subtitle(config))?,
            caption: CAPTION.into(),
            title,
        };
        Ok(Some(AmplitudeFiles {
            plot: results.write("amplitudes", "svg", &picture.svg)?,
            report: results.write("amplitudes", "html", &picture.html())?,
        }))
    }
}

/// The excitation, and the conditions of the runs.
fn subtitle(config: &Config) -> String {
    joined(&[
        &config.excitation_text(),
        &plant_conditions(&config.plant, &[]),
    ])
}
