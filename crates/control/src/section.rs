//! A continuous first or second order section, H(s) = (b2 s^2 + b1 s + b0)/(a2 s^2 + a1 s + a0).

use nalgebra::Complex;

use super::Biquad;
use super::quadratic::quadratic_roots;
use super::unstable::ONLY_STABLE;

/// Coefficients of a section by rising power of s; s in rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section {
    /// b0, b1, b2.
    pub numerator: [f64; 3],
    /// a0, a1, a2.
    pub denominator: [f64; 3],
    /// Frequency in rad/s at which the discrete section has exactly the continuous response; none for low frequencies.
    pub prewarp_rad_s: Option<f64>,
}

/// The reason why a section is invalid.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SectionError {
    /// More zeros than poles: infinite gain at high frequency.
    #[error(
        "is improper: its numerator has order {numerator}, its denominator {denominator}; add a pole"
    )]
    Improper {
        /// Order of the numerator.
        numerator: usize,
        /// Order of the denominator.
        denominator: usize,
    },
    /// A pole in the right half plane, or on the imaginary axis outside of the origin.
    #[error(
        "is unstable: it has a pole at {re_rad_s:.4} {im_rad_s:+.4}j rad/s; move the pole to the left of the imaginary axis (poles at the origin, integrators, are allowed); {ONLY_STABLE}"
    )]
    Unstable {
        /// Real part.
        re_rad_s: f64,
        /// Imaginary part.
        im_rad_s: f64,
    },
    /// A coefficient that is not finite, or a denominator whose coefficients are all 0.
    #[error(
        "has a denominator whose coefficients are all 0, or a coefficient that is not finite; correct its coefficients"
    )]
    Degenerate,
}

impl Section {
    /// H(s).
    pub fn response(&self, s: Complex<f64>) -> Complex<f64> {
        let at = |c: &[f64; 3]| (s * c[2] + c[1]) * s + c[0];
        at(&self.numerator) / at(&self.denominator)
    }

    /// This section, if it is proper and has no unstable pole. Poles at the origin are allowed.
    pub fn checked(self) -> Result<Section, SectionError> {
        let mut coefficients = self.numerator.iter().chain(&self.denominator);
        let is_finite = coefficients.all(|c| c.is_finite());
        let denominator = order(&self.denominator).filter(|_| is_finite);
        let denominator = denominator.ok_or(SectionError::Degenerate)?;
        let numerator = order(&self.numerator).unwrap_or(0);
        if numerator > denominator {
            return Err(SectionError::Improper {
                numerator,
                denominator,
            });
        }
        match self.unstable_pole() {
            Some(pole) => Err(SectionError::Unstable {
                re_rad_s: pole.re,
                im_rad_s: pole.im,
            }),
            None => Ok(self),
        }
    }

    /// A pole in the right half plane or on the imaginary axis, except for the origin.
    fn unstable_pole(&self) -> Option<Complex<f64>> {
        let poles = self.poles().into_iter();
        let mut others = poles.filter(|pole| pole.norm() > 0.0);
        others.find(|pole| pole.re >= 0.0)
    }

    /// Number of integrators: poles at the origin.
    pub(super) fn integrators(&self) -> usize {
        let poles = self.poles().into_iter();
        poles.filter(|pole| pole.norm() == 0.0).count()
    }

    /// Roots of the denominator.
    pub fn poles(&self) -> Vec<Complex<f64>> {
        let [a0, a1, a2] = self.denominator;
        match order(&self.denominator) {
            Some(2) => quadratic_roots(a2, a1, a0).to_vec(),
            Some(1) => vec![Complex::new(-a0 / a1, 0.0)],
            _ => Vec::new(),
        }
    }

    /// Tustin's rule, s = c (z - 1)/(z + 1), with c = 2/T, or c = w/tan(w T/2) where the section is prewarped at w.
    pub fn tustin(&self, period_s: f64) -> Biquad {
        let c = match self.prewarp_rad_s {
            Some(w) => w / libm::tan(w * period_s / 2.0),
            None => 2.0 / period_s,
        };
        // A section of lower order is mapped without the common factors (z + 1), each of which would be a mode at half the
        // sampling rate.
        let map = match order(&self.numerator).max(order(&self.denominator)) {
            None | Some(0) => constant,
            Some(1) => first_order,
            Some(_) => second_order,
        };
        Biquad::new(map(&self.numerator, c), map(&self.denominator, c))
    }
}

fn constant(p: &[f64; 3], _c: f64) -> [f64; 3] {
    [p[0], 0.0, 0.0]
}

/// Times (z + 1): s -> c (z - 1). Powers of z^-1 from z downwards.
fn first_order(p: &[f64; 3], c: f64) -> [f64; 3] {
    [p[0] + p[1] * c, p[0] - p[1] * c, 0.0]
}

/// Times (z + 1)^2: s -> c (z^2 - 1), s^2 -> c^2 (z - 1)^2. Powers of z^-1 from z^2 downwards.
fn second_order(p: &[f64; 3], c: f64) -> [f64; 3] {
    let (p1, p2) = (p[1] * c, p[2] * c * c);
    [p[0] + p1 + p2, 2.0 * (p[0] - p2), p[0] - p1 + p2]
}

fn order(coefficients: &[f64; 3]) -> Option<usize> {
    coefficients.iter().rposition(|c| *c != 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BiquadState;

    fn section(numerator: [f64; 3], denominator: [f64; 3]) -> Section {
        Section {
            numerator,
            denominator,
            prewarp_rad_s: None,
        }
    }

    #[test]
    fn tustin_is_the_continuous_response_at_the_warped_frequency() {
        // H(z) at exp(j w T) equals H(s) at j (2/T) tan(w T/2): the definition of the rule.
        let notch = section([270_400.0, 10.4, 1.0], [308_025.0, 111.0, 1.0]);
        let lead = section([88.7, 1.0, 0.0], [625.0, 1.0, 0.0]);
        let integrator = section([51_110.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        for period_s in [2e-4, 1e-3] {
            for h in [notch, lead, integrator] {
                for w in [1.0, 100.0, 520.0, 1500.0] {
                    let angle: f64 = w * period_s;
                    let z = Complex::new(angle.cos(), angle.sin());
                    let warped = Complex::new(0.0, 2.0 / period_s * (angle / 2.0).tan());
                    let (discrete, continuous) =
                        (h.tustin(period_s).response(z), h.response(warped));
                    assert!(
                        (discrete - continuous).norm() < 1e-9 * continuous.norm(),
                        "{h:?} at {w}"
                    );
                }
            }
        }
    }

    #[test]
    fn section_of_lower_order_has_no_mode_at_half_the_sampling_rate() {
        // A common factor (z + 1) of numerator and denominator would continue as -1, +1, -1, ... without end after an
        // impulse.
        let gain = section([0.3, 0.0, 0.0], [1.5, 0.0, 0.0]);
        let pole = section([893.0, 0.0, 0.0], [893.0, 1.0, 0.0]);
        for (h, expected) in [(gain, 0.2), (pole, 1.0)] {
            let (biquad, mut state) = (h.tustin(2e-4), BiquadState::default());
            let response: Vec<f64> = (0..2000)
                .map(|k| biquad.update(&mut state, if k == 0 { 1.0 } else { 0.0 }))
                .collect();
            // The response of the pole after 2000 ticks is exp(-893 * 0.4) = 1e-155 of the first sample.
            assert!(
                (response.iter().sum::<f64>() - expected).abs() < 1e-12
                    && response[1999].abs() < 1e-100
            );
            let (a, ..) = biquad.state_space();
            assert!(
                a.complex_eigenvalues()
                    .iter()
                    .all(|pole| pole.norm() < 0.99),
                "{h:?}"
            );
        }
    }

    #[test]
    fn a_prewarped_section_is_exact_at_its_frequency() {
        let mut notch = section([270_400.0, 10.4, 1.0], [308_025.0, 111.0, 1.0]);
        let (w, period_s) = (520.0, 1e-3);
        let z = Complex::new(f64::cos(w * period_s), f64::sin(w * period_s));
        let continuous = notch.response(Complex::new(0.0, w));
        let plain = (notch.tustin(period_s).response(z) - continuous).norm() / continuous.norm();
        notch.prewarp_rad_s = Some(w);
        let warped = (notch.tustin(period_s).response(z) - continuous).norm() / continuous.norm();
        assert!(
            warped < 1e-10 && plain > 0.1,
            "prewarped {warped}, plain {plain}"
        );
    }

    #[test]
    fn rejects_improper_and_unstable_sections() {
        assert!(matches!(
            section([0.0, 0.0, 1.0], [1.0, 1.0, 0.0]).checked(),
            Err(SectionError::Improper { .. })
        ));
        assert!(matches!(
            section([1.0, 0.0, 0.0], [-5.0, 1.0, 0.0]).checked(),
            Err(SectionError::Unstable { .. })
        ));
        assert!(matches!(
            section([1.0, 0.0, 0.0], [25.0, -1.0, 1.0]).checked(),
            Err(SectionError::Unstable { .. })
        ));
        assert!(matches!(
            section([1.0, 0.0, 0.0], [25.0, 0.0, 1.0]).checked(),
            Err(SectionError::Unstable { .. })
        ));
        assert!(matches!(
            section([1.0, 0.0, 0.0], [0.0; 3]).checked(),
            Err(SectionError::Degenerate)
        ));
        assert!(matches!(
            section([f64::NAN, 0.0, 0.0], [1.0, 1.0, 0.0]).checked(),
            Err(SectionError::Degenerate)
        ));
        for (integrators, denominator) in [(1, [0.0, 1.0, 0.0]), (2, [0.0, 0.0, 1.0])] {
            let section = section([1.0, 0.0, 0.0], denominator).checked();
            assert_eq!(section.map(|s| s.integrators()), Ok(integrators));
        }
        assert!(section([1.0, 2.0, 3.0], [25.0, 1.0, 1.0]).checked().is_ok());
    }
}
