//! The overview of the runs of one excitation at several amplitudes.

use serde::Serialize;

use super::outputs::{OutputError, ResultFiles};
use crate::report::{AmplitudeOverview, Picture, amplitudes_svg};

const CAPTION: &str = "Frequency and compliance of the modes relative to the smallest amplitude, and their damping ratios, each with \
    its 95 % confidence interval: those of a linear stage do not depend on the amplitude. Noise of one period and distortion over the \
    whole band, as ratios of the amplitude of the output; distortion below the noise of its estimate is left out.";

/// The files of an overview; the names in JSON must not change.
#[derive(Clone, Debug, Serialize)]
pub struct AmplitudeFiles {
    /// The picture.
    pub plot: String,
    /// The page.
    pub report: String,
}

impl AmplitudeFiles {
    /// Draws an overview and writes it as a picture and a page.
    ///
    /// # Errors
    /// When it cannot be drawn, or a file cannot be written.
    pub fn write(
        overview: &AmplitudeOverview<'_>,
        title: &str,
        subtitle: &str,
        results: ResultFiles<'_>,
    ) -> Result<AmplitudeFiles, OutputError> {
        let picture = Picture {
            svg: amplitudes_svg(overview, title, subtitle)?,
            caption: CAPTION.into(),
            title: title.into(),
        };
        Ok(AmplitudeFiles {
            plot: results.write("amplitudes", "svg", &picture.svg)?,
            report: results.write("amplitudes", "html", &picture.html())?,
        })
    }
}
