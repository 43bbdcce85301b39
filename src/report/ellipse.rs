//! Where a number of two parts lies, by its covariance.

/// Of a normal distribution in the plane, 95 % lie within so many sigmas: sqrt(-2 ln 0.05).
pub const SIGMAS_95_PLANE: f64 = 2.447_746_830_680_816;
const CORNERS: usize = 72;

/// An ellipse by its axes: half their lengths, the longer first, and the angle of that one from the first part on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// Half of the longer and of the shorter axis.
    pub half_axes: [f64; 2],
    /// From the first part towards the second, in radians.
    pub angle_rad: f64,
}

impl Ellipse {
    /// Within which a number of this covariance lies with 95 %, for errors of a normal distribution; `None` where the
    /// covariance is not finite.
    ///
    /// With m = (a + d)/2 and r = sqrt(((a - d)/2)^2 + b^2) of [[a, b], [b, d]] the variances along the axes are m +- r, and the
    /// longer axis is turned by atan2(2 b, a - d)/2.
    pub fn of_95_percent([[a, b], [_, d]]: [[f64; 2]; 2]) -> Option<Ellipse> {
        let (mean, half) = (0.5 * (a + d), 0.5 * (a - d));
        let radius = libm::hypot(half, b);
        let axis = |variance: f64| SIGMAS_95_PLANE * variance.max(0.0).sqrt();
        let all = Ellipse {
            half_axes: [axis(mean + radius), axis(mean - radius)],
            angle_rad: 0.5 * libm::atan2(b, half),
        };
        (all.half_axes[0].is_finite() && all.angle_rad.is_finite()).then_some(all)
    }

    /// Its outline about a centre, closed.
    pub fn outline(&self, (x, y): (f64, f64)) -> Vec<(f64, f64)> {
        let (sin, cos) = (libm::sin(self.angle_rad), libm::cos(self.angle_rad));
        let at = |k: usize| {
            let turn = 2.0 * std::f64::consts::PI * (k % CORNERS) as f64 / CORNERS as f64;
            let (along, across) = (
                self.half_axes[0] * libm::cos(turn),
                self.half_axes[1] * libm::sin(turn),
            );
            (
                x + along * cos - across * sin,
                y + along * sin + across * cos,
            )
        };
        (0..=CORNERS).map(at).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axes_are_those_of_the_closed_form() {
        // [[a, b], [b, d]] = R(30 deg) diag(9, 4) R(-30 deg): a = 9 cos^2 + 4 sin^2, d = 9 sin^2 + 4 cos^2, b = (9 - 4) sin cos.
        let root3 = 3f64.sqrt();
        let ellipse = Ellipse::of_95_percent([[7.75, 1.25 * root3], [1.25 * root3, 5.25]]).unwrap();
        // The chi-squared distribution of two degrees of freedom: P(x < k^2) = 1 - exp(-k^2/2).
        let k = (-2.0 * 0.05f64.ln()).sqrt();
        // Sums and roots of numbers below 10: a few roundings of 1e-15.
        assert!(
            (ellipse.half_axes[0] - 3.0 * k).abs() < 1e-13
                && (ellipse.half_axes[1] - 2.0 * k).abs() < 1e-13
        );
        assert!((ellipse.angle_rad - std::f64::consts::PI / 6.0).abs() < 1e-14);
        for (x, y) in ellipse.outline((1.0, -2.0)) {
            let (u, v) = (x - 1.0, y + 2.0);
            // v^T C^-1 v = k^2 on the outline; det C = 36.
            let form = (5.25 * u * u - 2.0 * 1.25 * root3 * u * v + 7.75 * v * v) / 36.0;
            assert!((form / (k * k) - 1.0).abs() < 1e-12, "{form}");
        }
    }

    #[test]
    fn along_the_axes_a_covariance_without_correlation_lies_along_them() {
        let upright = Ellipse::of_95_percent([[1.0, 0.0], [0.0, 4.0]]).unwrap();
        assert!((upright.angle_rad.abs() - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        let flat = Ellipse::of_95_percent([[4.0, 0.0], [0.0, 0.0]]).unwrap();
        assert_eq!((flat.angle_rad, flat.half_axes[1]), (0.0, 0.0));
        assert!(flat.outline((0.0, 3.0)).iter().all(|point| point.1 == 3.0));
        assert_eq!(
            Ellipse::of_95_percent([[f64::INFINITY, 0.0], [0.0, 1.0]]),
            None
        );
        assert_eq!(Ellipse::of_95_percent([[f64::NAN, 0.0], [0.0, 1.0]]), None);
    }
}
