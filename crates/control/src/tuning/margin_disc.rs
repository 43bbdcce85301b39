//! The disc around the negative real axis that L must not enter for a gain margin and a phase margin.

use serde::Serialize;

/// The disc |L + x| < r.
///
/// It contains -1/GM and the points of the unit circle at the angles 180 deg +- PM from the positive real axis:
///
/// ```text
///  x - r = 1/GM,   (x - cos PM)^2 + sin^2 PM = r^2
///  =>  x = (1 - 1/GM^2)/(2 (cos PM - 1/GM))
/// ```
///
/// A loop whose Nyquist curve does not enter it has at least both margins, also when gain and phase change together. With the gain
/// margin 1/(1 - m) and the phase margin 2 asin(m/2) of a modulus margin m it is the disc of radius m around -1.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct MarginDisc {
    /// x.
    pub centre: f64,
    /// r.
    pub radius: f64,
}

impl MarginDisc {
    /// The disc of a gain margin (a ratio above 1) and a phase margin in rad. A margin that is `None` is the one which the modulus margin
    /// guarantees; no disc without any.
    ///
    /// # Errors
    /// No disc contains both points: cos PM <= 1/GM.
    pub fn of(
        modulus_margin: f64,
        gain_margin: Option<f64>,
        phase_margin_rad: Option<f64>,
    ) -> Result<Option<MarginDisc>, DiscError> {
        if gain_margin.is_none() && phase_margin_rad.is_none() {
            return Ok(None);
        }
        let gain_margin = gain_margin.unwrap_or(1.0 / (1.0 - modulus_margin));
        let phase_rad = phase_margin_rad.unwrap_or(2.0 * libm::asin(modulus_margin / 2.0));
        let (end, cosine) = (1.0 / gain_margin, libm::cos(phase_rad));
        if cosine - end < LEAST_DIFFERENCE {
            return Err(DiscError {
                gain_margin,
                phase_margin_rad: phase_rad,
                least_gain_margin: 1.0 / (cosine - LEAST_DIFFERENCE).max(0.0),
            });
        }
        let centre = (1.0 - end * end) / (2.0 * (cosine - end));
        Ok(Some(MarginDisc {
            centre,
            radius: centre - end,
        }))
    }
}

/// A gain margin and a phase margin that no disc contains.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error(
    "a phase margin of {:.1} deg needs a gain margin above {least_gain_margin:.2}, not {gain_margin:.2}; raise --gain-margin or lower --phase-margin",
    phase_margin_rad.to_degrees()
)]
pub struct DiscError {
    /// The gain margin, given or that of the modulus margin.
    pub gain_margin: f64,
    /// The phase margin in rad, given or that of the modulus margin.
    pub phase_margin_rad: f64,
    /// The smallest gain margin that goes with the phase margin.
    pub least_gain_margin: f64,
}

/// Smallest cos PM - 1/GM: the disc reaches at most to about -1/0.05.
const LEAST_DIFFERENCE: f64 = 0.05;

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Complex;

    #[test]
    fn disc_of_the_margins_of_a_modulus_margin_is_the_disc_around_minus_one() {
        let phase_rad = 2.0 * libm::asin(0.25);
        let disc = MarginDisc::of(0.5, Some(2.0), Some(phase_rad))
            .unwrap()
            .unwrap();
        assert!((disc.centre - 1.0).abs() < 1e-12 && (disc.radius - 0.5).abs() < 1e-12);
    }

    #[test]
    fn boundary_passes_through_both_margins() {
        let disc = MarginDisc::of(0.5, Some(2.5), Some(0.9)).unwrap().unwrap();
        let unit = Complex::new(-libm::cos(0.9), libm::sin(0.9));
        for point in [Complex::new(-0.4, 0.0), unit, unit.conj()] {
            assert!(((point + disc.centre).norm() - disc.radius).abs() < 1e-12);
        }
    }

    #[test]
    fn names_the_gain_margin_that_a_phase_margin_needs() {
        let error = MarginDisc::of(0.5, None, Some(1.2)).unwrap_err();
        assert!((error.least_gain_margin - 1.0 / (libm::cos(1.2) - 0.05)).abs() < 1e-9);
        assert!(MarginDisc::of(0.5, Some(error.least_gain_margin * 1.001), Some(1.2)).is_ok());
    }
}
