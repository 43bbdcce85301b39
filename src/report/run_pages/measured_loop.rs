//! The files of a loop with a measured plant: its responses as CSV, its plots.

use std::f64::consts::TAU;

use nalgebra::Complex;
use serde::Serialize;

use super::loop_marks::{marks, peak_mark};
use super::outputs::{OutputError, ResultFiles};
use crate::control::ClosedLoop;
use crate::control::measured::MeasuredMargins;
use crate::experiment::LoopCurves;
use crate::identify::frf_csv::{AMPERES_PER_METRE, METRES_PER_AMPERE, RATIO};
use crate::report::{
    MeasuredLoopPlot, MeasuredSensitivityPlot, measured_bode_svg, measured_nyquist_svg,
    measured_sensitivity_svg,
};

/// A loop with a measured plant.
#[derive(Clone)]
pub struct MeasuredLoopReport<'a> {
    /// Title of the plots.
    pub title: String,
    /// Line below the title.
    pub subtitle: String,
    /// The responses.
    pub curves: &'a LoopCurves,
    /// The margins of a stable loop.
    pub margins: Option<&'a MeasuredMargins>,
    /// Least allowed modulus margin; 0 for none.
    pub min_modulus_margin: f64,
    /// The loop of the model.
    pub model: &'a ClosedLoop,
}

/// Paths of the files; the names in JSON must not change.
#[derive(Clone, Debug, Serialize)]
pub struct MeasuredLoopFiles {
    /// L = P C.
    pub loop_csv: String,
    /// S = 1/(1 + L).
    pub sensitivity_csv: String,
    /// T = L/(1 + L).
    pub complementary_csv: String,
    /// C S in amperes per metre.
    pub control_csv: String,
    /// P S in metres per ampere.
    pub disturbance_csv: String,
    /// Bode plot of L with the margins.
    pub loop_plot: String,
    /// Nyquist plot of L.
    pub nyquist_plot: String,
    /// |S| and |T|.
    pub sensitivity_plot: String,
}

impl MeasuredLoopFiles {
    /// Writes the files.
    ///
    /// # Errors
    /// When a plot cannot be drawn, or a file cannot be written.
    pub fn write(
        report: &MeasuredLoopReport<'_>,
        results: ResultFiles<'_>,
    ) -> Result<MeasuredLoopFiles, OutputError> {
        let curves = report.curves;
        let frequencies = curves.loop_gain.frequency_hz.iter();
        let model: Vec<Complex<f64>> = frequencies
            .map(|f| report.model.sampled_loop(TAU * f))
            .collect();
        let loop_gain = &curves.loop_gain;
        let marks = report.margins.map_or(Vec::new(), |m| marks(m, loop_gain));
        let peak = report.margins.map(|margins| peak_mark(margins, loop_gain));
        let plot = MeasuredLoopPlot {
            loop_gain,
            model: &model,
            marks: &marks,
            modulus_margin: report.margins.map(|margins| margins.modulus_margin.value),
            title: &report.title,
            subtitle: &report.subtitle,
        };
        let (s, t) = (&curves.sensitivity, &curves.complementary);
        let sensitivity_plot = measured_sensitivity_svg(&MeasuredSensitivityPlot {
            sensitivity: s,
            complementary: t,
            model_loop: &model,
            peak: peak.as_ref(),
            min_modulus_margin: report.min_modulus_margin,
            title: &report.title,
            subtitle: &report.subtitle,
        })?;
        Ok(MeasuredLoopFiles {
            loop_csv: results.write_frf("loop", &curves.loop_gain, RATIO)?,
            sensitivity_csv: results.write_frf("sensitivity", s, RATIO)?,
            complementary_csv: results.write_frf("complementary", t, RATIO)?,
            control_csv: results.write_frf("control", &curves.control, AMPERES_PER_METRE)?,
            disturbance_csv: results.write_frf(
                "disturbance",
                &curves.disturbance,
                METRES_PER_AMPERE,
            )?,
            loop_plot: results.write("loop", "svg", &measured_bode_svg(&plot)?)?,
            nyquist_plot: results.write("nyquist", "svg", &measured_nyquist_svg(&plot)?)?,
            sensitivity_plot: results.write("sensitivity", "svg", &sensitivity_plot)?,
        })
    }

    /// Each file with its label.
    pub fn paths(&self) -> [(&'static str, &str); 8] {
        [
            ("L", &self.loop_csv),
            ("S", &self.sensitivity_csv),
            ("T", &self.complementary_csv),
            ("C S", &self.control_csv),
            ("P S", &self.disturbance_csv),
            ("plot", &self.loop_plot),
            ("plot", &self.nyquist_plot),
            ("plot", &self.sensitivity_plot),
        ]
    }
}
