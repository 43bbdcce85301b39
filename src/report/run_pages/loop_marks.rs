//! The margins of a measured loop, as marks of its plots.

use nalgebra::Complex;

use super::page::with_interval;
use crate::control::measured::MeasuredMargins;
use crate::identify::Frf;
use crate::report::MeasuredMark;
use crate::report::labels::frequency_text;
use crate::util::units::hz;

/// The crossover with its phase margin, and the peak of |S|.
pub(super) fn marks(margins: &MeasuredMargins, loop_gain: &Frf) -> Vec<MeasuredMark> {
    let crossover = margins.crossover().map(|crossing| {
        let margin_deg = crossing.phase_margin_deg;
        let argument = (margin_deg.value - 180.0).to_radians();
        let (margin, frequency_hz) = (with_interval(margin_deg, 1.0), hz(crossing.rad_s.value));
        MeasuredMark {
            label: format!(
                "phase margin {margin} deg at the crossover, {}",
                frequency_text(frequency_hz)
            ),
            frequency_hz,
            loop_gain: Complex::from_polar(1.0, argument),
        }
    });
    let peak = peak_mark(margins, loop_gain);
    crossover.into_iter().chain([peak]).collect()
}

/// The peak of |S|.
pub(super) fn peak_mark(margins: &MeasuredMargins, loop_gain: &Frf) -> MeasuredMark {
    let (frequency_hz, margin) = (hz(margins.sensitivity_peak_rad_s), margins.modulus_margin);
    let margin = with_interval(margin, 1.0);
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
