//! What a zero in the right half plane leaves to a controller: Eqs. (1-1) to (1-3).
//!
//! If loop and closed loop are stable and |S(jw)| < alpha < 1 for all w < w0, a zero z = x + jy with x > 0 forces
//! max |S| > (1/alpha)^(Theta/(pi - Theta)), where Theta is the angle at which z sees the interval from -j w0 to j w0.

use nalgebra::Complex;

use super::{Zero, ZeroKind};

/// Theta of Eq. (1-2) in radians, 0 to pi: atan((w0 - y)/x) + atan((w0 + y)/x).
pub fn opening_angle(zero_rad_s: Complex<f64>, omega_0_rad_s: f64) -> f64 {
    let (x, y) = (zero_rad_s.re, zero_rad_s.im);
    // The same angle from one arctangent: no difference of two that are nearly equal where |y| is far above w0.
    (2.0 * x * omega_0_rad_s).atan2(x * x + y * y - omega_0_rad_s * omega_0_rad_s)
}

/// The peak of |S| that Eq. (1-3) guarantees, a ratio above 1: (1/alpha)^(Theta/(pi - Theta)).
pub fn guaranteed_peak(alpha: f64, opening_angle_rad: f64) -> f64 {
    (1.0 / alpha).powf(opening_angle_rad / (std::f64::consts::PI - opening_angle_rad))
}

/// The largest Theta in radians that allows max |S| = `peak` with |S| < `alpha` in the band: Eq. (1-3) solved for it.
pub fn opening_angle_allowed(alpha: f64, peak: f64) -> f64 {
    let power = peak.ln() / (1.0 / alpha).ln();
    std::f64::consts::PI * power / (1.0 + power)
}

/// The w0 in rad/s at which the zero sees the band under the angle Theta (0 to pi): Eq. (1-2) solved for it,
/// w0^2 sin Theta + 2 x w0 cos Theta - |z|^2 sin Theta = 0.
pub fn bandwidth_rad_s(zero_rad_s: Complex<f64>, opening_angle_rad: f64) -> f64 {
    let (sine, cosine) = opening_angle_rad.sin_cos();
    let along = zero_rad_s.re * cosine;
    let square = zero_rad_s.norm_sqr();
    let root = (along * along + square * sine * sine).sqrt();
    // Of the two forms of the positive root the one that adds.
    if along >= 0.0 {
        square * sine / (along + root)
    } else {
        (root - along) / sine
    }
}

/// The bound of one zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bound {
    /// The zero, in the right half plane, with an imaginary part that is not negative.
    pub zero: Zero,
    /// The largest w0 in rad/s below which |S| can stay under alpha without passing the peak.
    pub bandwidth_rad_s: f64,
}

impl Bound {
    /// The bounds of all zeros in the right half plane, one a pair, the narrowest band first; `alpha` below 1, `peak`
    /// above 1.
    pub fn of(zeros: &[Zero], alpha: f64, peak: f64) -> Vec<Bound> {
        let angle = opening_angle_allowed(alpha, peak);
        let right =
            |zero: &&Zero| matches!(zero.kind, ZeroKind::Rnmp | ZeroKind::Cnmp) && zero.s.im >= 0.0;
        let bound = |zero: &Zero| Bound {
            zero: *zero,
            bandwidth_rad_s: bandwidth_rad_s(zero.s, angle),
        };
        let mut bounds: Vec<Bound> = zeros.iter().filter(right).map(bound).collect();
        bounds.sort_by(|a, b| a.bandwidth_rad_s.total_cmp(&b.bandwidth_rad_s));
        bounds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    #[test]
    fn a_circle_about_the_origin_is_seen_under_a_right_angle() {
        // Fig 1-3a: |z| = w0, wherever on the circle; then the power is 1 and the peak 1/alpha.
        for angle in [0.0, 0.5, 1.5] {
            let z = Complex::from_polar(7.0, angle);
            assert!((opening_angle(z, 7.0) - FRAC_PI_2).abs() < 1e-14);
            assert!((bandwidth_rad_s(z, FRAC_PI_2) - 7.0).abs() < 1e-13);
        }
        assert!((guaranteed_peak(0.25, FRAC_PI_2) - 4.0).abs() < 1e-14);
        assert!((opening_angle_allowed(0.25, 4.0) - FRAC_PI_2).abs() < 1e-15);
    }

    #[test]
    fn of_zeros_of_one_frequency_the_real_one_leaves_the_least() {
        // Section 1.2, last remark on Fig 1-4.
        let at = |angle: f64| bandwidth_rad_s(Complex::from_polar(1.0, angle), PI / 6.0);
        let falling: Vec<f64> = [0.0, 0.4, 0.8, 1.2, 1.5].into_iter().map(at).collect();
        assert!(
            falling.windows(2).all(|pair| pair[0] < pair[1]),
            "{falling:?}"
        );
        // On the real axis the half angle is seen by w0/x.
        assert!((falling[0] - (PI / 12.0).tan()).abs() < 1e-15);
    }

    proptest! {
        #[test]
        fn solving_for_the_band_and_back_gives_the_angle(re in -3.0..3.0f64, im in -3.0..3.0f64, angle in 0.001..3.13f64) {
            let z = Complex::new(10f64.powf(re), 10f64.powf(im));
            let back = opening_angle(z, bandwidth_rad_s(z, angle));
            // Near a zero close to the axis the angle turns over within x/y of the frequency: rounding times y/x.
            prop_assert!((back - angle).abs() < 1e-14 * (1.0 + z.im / z.re), "{back} for {angle}");
        }

        #[test]
        fn the_angle_is_the_sum_of_the_two_arctangents(re in 0.01..10.0f64, im in 0.0..10.0f64, w0 in 0.01..50.0f64) {
            let direct = ((w0 - im) / re).atan() + ((w0 + im) / re).atan();
            prop_assert!((opening_angle(Complex::new(re, im), w0) - direct).abs() < 1e-13);
        }
    }
}
