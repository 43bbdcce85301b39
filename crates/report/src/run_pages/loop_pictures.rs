//! The pictures of a measured loop, with its margins as marks.

use nalgebra::Complex;

use crate::figures::interval_of;
use crate::labels::frequency_text;
use crate::{
    MeasuredLoopPlot, MeasuredMark, MeasuredSensitivityPlot, ReportError, measured_bode_svg,
    measured_nyquist_svg, measured_sensitivity_svg,
};
use bench_base::units::hz;
use bench_control::measured::MeasuredMargins;
use bench_identify::Frf;

/// A measured loop beside that of the model.
pub(super) struct MeasuredLoop<'a> {
    /// Measured L.
    pub loop_gain: &'a Frf,
    /// Measured S.
    pub sensitivity: &'a Frf,
    /// Measured T.
    pub complementary: &'a Frf,
    /// L of the model at the same frequencies.
    pub model: &'a [Complex<f64>],
    /// The margins of a stable loop.
    pub margins: Option<&'a MeasuredMargins>,
    /// Least allowed modulus margin; 0 for none.
    pub min_modulus_margin: f64,
    /// Title of the pictures.
    pub title: &'a str,
    /// Line below the title.
    pub subtitle: &'a str,
}

impl MeasuredLoop<'_> {
    /// Bode plot and Nyquist plot of L, and |S| and |T|, as SVG documents.
    ///
    /// # Errors
    /// When a response is invalid.
    pub fn pictures(&self) -> Result<[String; 3], ReportError> {
        let (title, subtitle) = (self.title, self.subtitle);
        let peak = self
            .margins
            .map(|margins| peak_mark(margins, self.loop_gain));
        let marks: Vec<MeasuredMark> = self
            .margins
            .and_then(crossover_mark)
            .into_iter()
            .chain(peak.clone())
            .collect();
        let plot = MeasuredLoopPlot {
            loop_gain: self.loop_gain,
            model: self.model,
            marks: &marks,
            modulus_margin: self.margins.map(|margins| margins.modulus_margin.value),
            title,
            subtitle,
        };
        let sensitivities = MeasuredSensitivityPlot {
            sensitivity: self.sensitivity,
            complementary: self.complementary,
            model_loop: self.model,
            peak: peak.as_ref(),
            min_modulus_margin: self.min_modulus_margin,
            title,
            subtitle,
        };
        Ok([
            measured_bode_svg(&plot)?,
            measured_nyquist_svg(&plot)?,
            measured_sensitivity_svg(&sensitivities)?,
        ])
    }
}

/// The crossover with its phase margin, if there is one.
fn crossover_mark(margins: &MeasuredMargins) -> Option<MeasuredMark> {
    let crossing = margins.crossover()?;
    let margin_deg = crossing.phase_margin_deg;
    let argument = (margin_deg.value - 180.0).to_radians();
    let (margin, frequency_hz) = (interval_of(margin_deg), hz(crossing.rad_s.value));
    let place = frequency_text(frequency_hz);
    Some(MeasuredMark {
        label: format!("phase margin {margin} deg at the crossover, {place}"),
        frequency_hz,
        loop_gain: Complex::from_polar(1.0, argument),
    })
}

/// The peak of |S|.
fn peak_mark(margins: &MeasuredMargins, loop_gain: &Frf) -> MeasuredMark {
    let (frequency_hz, margin) = (hz(margins.sensitivity_peak_rad_s), margins.modulus_margin);
    let margin = interval_of(margin);
    MeasuredMark {
        label: format!(
            "modulus margin {margin} (peak of |S|) at {}",
            frequency_text(frequency_hz)
        ),
        frequency_hz,
        loop_gain: value_nearest(loop_gain, frequency_hz),
    }
}

/// The response at the measured frequency that is nearest to a frequency.
fn value_nearest(frf: &Frf, frequency_hz: f64) -> Complex<f64> {
    let distance = |measured_hz: f64| (measured_hz - frequency_hz).abs();
    let points = frf.frequency_hz.iter().zip(&frf.response);
    let nearest = points.min_by(|(a, _), (b, _)| distance(**a).total_cmp(&distance(**b)));
    nearest.map_or(Complex::ZERO, |(_, response)| *response)
}
