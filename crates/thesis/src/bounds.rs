//! Limits that a zero in the right half plane sets to every controller: Eqs. (1-1) to (1-3).
//!
//! If loop and closed loop are stable and |S(jw)| < alpha < 1 for all w < w0, a zero z = x + jy with x > 0 forces
//! max |S| > (1/alpha)^(Theta/(pi - Theta)), where Theta is the angle that the interval from -j w0 to j w0 subtends at z.

use nalgebra::Complex;
use serde::Serialize;

use bench_plant::zeros::Zero;

/// Theta of Eq. (1-2) in radians, 0 to pi: atan((w0 - y)/x) + atan((w0 + y)/x).
pub fn opening_angle(zero_rad_s: Complex<f64>, omega_0_rad_s: f64) -> f64 {
    let (x, y) = (zero_rad_s.re, zero_rad_s.im);
    // The sum as one arctangent: where |y| is far above w0, two arctangents would cancel.
    (2.0 * x * omega_0_rad_s).atan2(x * x + y * y - omega_0_rad_s * omega_0_rad_s)
}

/// The peak of |S| that Eq. (1-3) guarantees, a ratio above 1: (1/alpha)^(Theta/(pi - Theta)).
pub fn guaranteed_peak(alpha: f64, opening_angle_rad: f64) -> f64 {
    (1.0 / alpha).powf(opening_angle_rad / (std::f64::consts::PI - opening_angle_rad))
}

/// The largest Theta in radians that allows max |S| = `peak` with |S| < `alpha` in the band: Eq. (1-3) solved for Theta.
pub fn opening_angle_allowed(alpha: f64, peak: f64) -> f64 {
    let power = peak.ln() / (1.0 / alpha).ln();
    std::f64::consts::PI * power / (1.0 + power)
}

/// The w0 in rad/s at which the band, viewed from the zero, has the opening angle Theta (0 to pi). Eq. (1-2) solved for w0:
/// w0^2 sin Theta + 2 x w0 cos Theta - |z|^2 sin Theta = 0.
pub fn bandwidth_rad_s(zero_rad_s: Complex<f64>, opening_angle_rad: f64) -> f64 {
    let (sine, cosine) = opening_angle_rad.sin_cos();
    let along = zero_rad_s.re * cosine;
    let square = zero_rad_s.norm_sqr();
    let root = (along * along + square * sine * sine).sqrt();
    // The form of the positive root without cancellation.
    if along >= 0.0 {
        square * sine / (along + root)
    } else {
        (root - along) / sine
    }
}

/// The demand on the sensitivity S beside |S| < alpha in the band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Demand {
    /// A limit of |S| at all frequencies, above 1: the bound is a bandwidth.
    Peak(f64),
    /// A bandwidth in rad/s: the bound is a peak of |S|.
    Bandwidth(f64),
}

/// The bound of one zero.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bound {
    /// The zero, in the right half plane, with an imaginary part that is not negative.
    #[serde(flatten)]
    pub zero: Zero,
    /// The largest w0 in rad/s below which |S| < alpha is possible without passing the peak, or the bandwidth demanded.
    pub bandwidth_rad_s: f64,
    /// The angle Theta that this band subtends at the zero, in degrees.
    pub opening_angle_deg: f64,
    /// The peak of |S| that Eq. (1-3) guarantees.
    pub sensitivity_peak: f64,
}

impl Bound {
    /// The bounds of all zeros in the right half plane, one per pair, the narrowest band first; `alpha` between
    /// 0 and 1.
    pub fn of(zeros: &[Zero], alpha: f64, demand: Demand) -> Vec<Bound> {
        let right = zeros
            .iter()
            .filter(|zero| zero.kind.is_non_minimum_phase() && zero.s.im >= 0.0);
        let mut bounds: Vec<Bound> = right.map(|zero| Bound::new(*zero, alpha, demand)).collect();
        bounds.sort_by(|a, b| {
            let by_band = a.bandwidth_rad_s.total_cmp(&b.bandwidth_rad_s);
            by_band.then(b.sensitivity_peak.total_cmp(&a.sensitivity_peak))
        });
        bounds
    }

    fn new(zero: Zero, alpha: f64, demand: Demand) -> Bound {
        let bandwidth_rad_s = match demand {
            Demand::Peak(peak) => bandwidth_rad_s(zero.s, opening_angle_allowed(alpha, peak)),
            Demand::Bandwidth(omega_rad_s) => omega_rad_s,
        };
        let angle = opening_angle(zero.s, bandwidth_rad_s);
        Bound {
            zero,
            bandwidth_rad_s,
            opening_angle_deg: angle.to_degrees(),
            sensitivity_peak: guaranteed_peak(alpha, angle),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn opening_angle_of_a_circle_about_the_origin_is_a_right_angle() {
        // Fig 1-3a: |z| = w0, at any point of the circle; then the power is 1 and the peak 1/alpha.
        for angle in [0.0, 0.5, 1.5] {
            let z = Complex::from_polar(7.0, angle);
            assert!((opening_angle(z, 7.0) - FRAC_PI_2).abs() < 1e-14);
            assert!((bandwidth_rad_s(z, FRAC_PI_2) - 7.0).abs() < 1e-13);
        }
        assert!((guaranteed_peak(0.25, FRAC_PI_2) - 4.0).abs() < 1e-14);
        assert!((opening_angle_allowed(0.25, 4.0) - FRAC_PI_2).abs() < 1e-15);
    }

    #[test]
    fn real_zero_is_the_most_restrictive_of_one_frequency() {
        // Section 1.2, last remark on Fig 1-4.
        let at = |angle: f64| bandwidth_rad_s(Complex::from_polar(1.0, angle), PI / 6.0);
        let falling: Vec<f64> = [0.0, 0.4, 0.8, 1.2, 1.5].into_iter().map(at).collect();
        assert!(
            falling.windows(2).all(|pair| pair[0] < pair[1]),
            "{falling:?}"
        );
        // On the real axis, tan(Theta/2) = w0/x.
        assert!((falling[0] - (PI / 12.0).tan()).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn bandwidth_and_angle_are_inverse(re in -3.0..3.0f64, im in -3.0..3.0f64, angle in 0.001..3.13f64) {
            let z = Complex::new(10f64.powf(re), 10f64.powf(im));
            let back = opening_angle(z, bandwidth_rad_s(z, angle));
            // For a zero close to the imaginary axis, the angle changes within x/y of the frequency: the rounding is
            // multiplied by y/x.
            prop_assert!((back - angle).abs() < 1e-14 * (1.0 + z.im / z.re), "{back} for {angle}");
        }

        #[test]
        fn angle_is_the_sum_of_two_arctangents(re in 0.01..10.0f64, im in 0.0..10.0f64, w0 in 0.01..50.0f64) {
            let direct = ((w0 - im) / re).atan() + ((w0 + im) / re).atan();
            prop_assert!((opening_angle(Complex::new(re, im), w0) - direct).abs() < 1e-13);
        }
    }
}
