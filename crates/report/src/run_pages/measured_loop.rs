//! The files of a loop with a measured plant: its responses as CSV, its plots.

use std::f64::consts::TAU;

use nalgebra::Complex;
use serde::Serialize;

use super::loop_pictures::MeasuredLoop;
use super::page_error::PageError;
use bench_control::ClosedLoop;
use bench_control::measured::MeasuredMargins;
use bench_experiment::LoopCurves;
use bench_experiment::outputs::ResultFiles;
use bench_identify::frf_csv::{AMPERES_PER_METRE, METRES_PER_AMPERE, RATIO};

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
    ) -> Result<MeasuredLoopFiles, PageError> {
        let curves = report.curves;
        let frequencies = curves.loop_gain.frequency_hz.iter();
        let model: Vec<Complex<f64>> = frequencies
            .map(|f| report.model.sampled_loop(TAU * f))
            .collect();
        let loop_gain = &curves.loop_gain;
        let (s, t) = (&curves.sensitivity, &curves.complementary);
        let [bode, nyquist, sensitivities] = MeasuredLoop {
            loop_gain,
            sensitivity: s,
            complementary: t,
            model: &model,
            margins: report.margins,
            min_modulus_margin: report.min_modulus_margin,
            title: &report.title,
            subtitle: &report.subtitle,
        }
        .pictures()?;
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
            loop_plot: results.write("loop", "svg", &bode)?,
            nyquist_plot: results.write("nyquist", "svg", &nyquist)?,
            sensitivity_plot: results.write("sensitivity", "svg", &sensitivities)?,
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
