//! Confidence regions in the plane.

use std::f64::consts::TAU;

/// Radius in sigmas that contains 95 % of a normal distribution in the plane: sqrt(-2 ln 0.05).
pub const SIGMAS_95_PLANE: f64 = 2.447_746_830_680_816;
const ELLIPSE_CORNERS: usize = 72;
const CIRCLE_CORNERS: usize = 24;

/// An ellipse by its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipse {
    /// Half of the longer and of the shorter axis.
    pub half_axes: [f64; 2],
    /// Angle of the longer axis from the first coordinate towards the second, in radians.
    pub angle_rad: f64,
}

impl Ellipse {
    /// The 95 % confidence region of a point with this covariance, for normally distributed errors; `None` where the
    /// covariance is not finite.
    ///
    /// With m = (a + d)/2 and r = sqrt(((a - d)/2)^2 + b^2) of [[a, b], [b, d]] the variances along the axes are m ± r, and
    /// the longer axis is turned by atan2(2 b, a - d)/2.
    pub fn of_95_percent([[a, b], [_, d]]: [[f64; 2]; 2]) -> Option<Ellipse> {
        let (mean, half) = (0.5 * (a + d), 0.5 * (a - d));
        let radius = libm::hypot(half, b);
        let variances = [mean + radius, mean - radius];
        let ellipse = Ellipse {
            half_axes: variances.map(|variance| SIGMAS_95_PLANE * variance.max(0.0).sqrt()),
            angle_rad: 0.5 * libm::atan2(b, half),
        };
        let finite = ellipse.half_axes[0].is_finite() && ellipse.angle_rad.is_finite();
        finite.then_some(ellipse)
    }

    /// The closed outline about a centre.
    pub fn outline(&self, (x, y): (f64, f64)) -> Vec<(f64, f64)> {
        let (sin, cos) = libm::sincos(self.angle_rad);
        let [long, short] = self.half_axes;
        let unit = closed_circle(ELLIPSE_CORNERS).into_iter();
        let upright = unit.map(|(along, across)| (long * along, short * across));
        upright
            .map(|(along, across)| {
                (
                    x + along * cos - across * sin,
                    y + along * sin + across * cos,
                )
            })
            .collect()
    }
}

/// The closed outline of a circle.
pub fn circle((x, y): (f64, f64), radius: f64) -> Vec<(f64, f64)> {
    let unit = closed_circle(CIRCLE_CORNERS).into_iter();
    unit.map(|(re, im)| (x + radius * re, y + radius * im))
        .collect()
}

/// Points of the unit circle; the last is the first.
fn closed_circle(corners: usize) -> Vec<(f64, f64)> {
    let angles = (0..=corners).map(|k| TAU * (k % corners) as f64 / corners as f64);
    angles
        .map(|angle| (libm::cos(angle), libm::sin(angle)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_those_of_the_closed_form() {
        // [[a, b], [b, d]] = R(30 deg) diag(9, 4) R(-30 deg): a = 9 cos^2 + 4 sin^2, d = 9 sin^2 + 4 cos^2, b = (9 - 4) sin cos.
        let root3 = 3f64.sqrt();
        let ellipse = Ellipse::of_95_percent([[7.75, 1.25 * root3], [1.25 * root3, 5.25]]).unwrap();
        // The chi-squared distribution of two degrees of freedom: P(x < k^2) = 1 - exp(-k^2/2).
        let k = (-2.0 * 0.05f64.ln()).sqrt();
        // Sums and roots of numbers below 10: a few roundings of 1e-15.
        assert!((ellipse.half_axes[0] - 3.0 * k).abs() < 1e-13);
        assert!((ellipse.half_axes[1] - 2.0 * k).abs() < 1e-13);
        assert!((ellipse.angle_rad - std::f64::consts::PI / 6.0).abs() < 1e-14);
        for (x, y) in ellipse.outline((1.0, -2.0)) {
            let (u, v) = (x - 1.0, y + 2.0);
            // v^T C^-1 v = k^2 on the outline; det C = 36.
            let form = (5.25 * u * u - 2.0 * 1.25 * root3 * u * v + 7.75 * v * v) / 36.0;
            assert!((form / (k * k) - 1.0).abs() < 1e-12, "{form}");
        }
    }

    #[test]
    fn axes_are_parallel_to_the_coordinates_without_correlation() {
        let upright = Ellipse::of_95_percent([[1.0, 0.0], [0.0, 4.0]]).unwrap();
        assert!((upright.angle_rad.abs() - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
        let flat = Ellipse::of_95_percent([[4.0, 0.0], [0.0, 0.0]]).unwrap();
        assert_eq!((flat.angle_rad, flat.half_axes[1]), (0.0, 0.0));
        assert!(flat.outline((0.0, 3.0)).iter().all(|point| point.1 == 3.0));
    }

    #[test]
    fn an_infinite_covariance_has_no_ellipse() {
        assert_eq!(
            Ellipse::of_95_percent([[f64::INFINITY, 0.0], [0.0, 1.0]]),
            None
        );
        assert_eq!(Ellipse::of_95_percent([[f64::NAN, 0.0], [0.0, 1.0]]), None);
    }
}
