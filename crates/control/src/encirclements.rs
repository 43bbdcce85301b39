//! Stability by Nyquist's criterion: the unstable poles of a closed loop, counted by the turns of its curve.
//!
//! F = 1 + L along z = exp(j w T) from w = 0+ to pi/T turns by D. F has as many zeros as poles, the zeros being the poles of the
//! closed loop. The contour passes outside of the q poles at z = 1 (a small half circle, on the upper half of which F turns by
//! -q pi/2). With U poles of the open loop outside the unit circle, the number of unstable poles of the closed loop is
//!
//! ```text
//! Z = U - (D - q pi/2)/pi
//! ```
//!
//! (H. Nyquist, Bell System Technical Journal 11, 1932.)

use std::f64::consts::{FRAC_PI_2, PI};

use nalgebra::Complex;

use super::law::OpenLoopPoles;

/// F turns by less than this between two neighbouring points, in rad ...
const MAX_TURN_RAD: f64 = 0.4;
/// ... and its magnitude changes by less than this factor.
const MAX_RATIO: f64 = 1.5;
/// Number of times an interval is halved: afterwards its ends differ by rounding only, so that the curve passes through -1.
const MAX_HALVINGS: u32 = 48;

/// Number of unstable poles of the closed loop, from the angle by which F turns.
pub(super) fn unstable_poles(open: OpenLoopPoles, turned_rad: f64) -> i64 {
    let turned_rad = turned_rad - open.integrators as f64 * FRAC_PI_2;
    open.unstable as i64 - libm::round(turned_rad / PI) as i64
}

/// The angle in rad by which a curve turns about the origin.
pub(super) fn turn_rad(curve: impl IntoIterator<Item = Complex<f64>>) -> f64 {
    let mut points = curve.into_iter();
    let Some(mut last) = points.next() else {
        return 0.0;
    };
    let steps = points.map(|point| {
        let step_rad = (point / last).arg();
        last = point;
        step_rad
    });
    steps.sum()
}

/// A point of a curve over frequency.
#[derive(Clone, Copy, Debug)]
pub(super) struct CurvePoint {
    /// Frequency in rad/s.
    pub rad_s: f64,
    /// F = 1 + L there.
    pub value: Complex<f64>,
}

impl CurvePoint {
    fn is_near(&self, other: &CurvePoint) -> bool {
        let ratio = other.value / self.value;
        let magnitude = ratio.norm();
        ratio.arg().abs() < MAX_TURN_RAD && magnitude < MAX_RATIO && magnitude > 1.0 / MAX_RATIO
    }
}

/// The curve over rising frequencies, with points added between them until neighbours differ little: no turn is missed, if the
/// frequencies show every peak of F by at least one point. `None` if the curve passes through the origin or is not finite.
pub(super) fn refined(
    curve: &dyn Fn(f64) -> Complex<f64>,
    frequencies_rad_s: &[f64],
) -> Option<Vec<CurvePoint>> {
    let at = |rad_s: f64| CurvePoint {
        rad_s,
        value: curve(rad_s),
    };
    let mut points = Vec::with_capacity(2 * frequencies_rad_s.len());
    // Points above the last accepted one, with the number of times that their interval was halved.
    let mut waiting: Vec<(CurvePoint, u32)> = Vec::new();
    for rad_s in frequencies_rad_s {
        waiting.push((at(*rad_s), 0));
        while let Some((next, halvings)) = waiting.pop() {
            let Some(last) = points.last() else {
                points.push(next);
                continue;
            };
            if CurvePoint::is_near(last, &next) {
                points.push(next);
            } else if halvings == MAX_HALVINGS {
                return None;
            } else {
                let middle = at(0.5 * (last.rad_s + next.rad_s));
                waiting.push((next, halvings + 1));
                waiting.push((middle, halvings + 1));
            }
        }
    }
    Some(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn poles(integrators: usize, unstable: usize) -> OpenLoopPoles {
        OpenLoopPoles {
            integrators,
            unstable,
        }
    }

    fn count(open: OpenLoopPoles, loop_gain: &dyn Fn(Complex<f64>) -> Complex<f64>) -> Option<i64> {
        let curve = |angle: f64| loop_gain(Complex::from_polar(1.0, angle)) + 1.0;
        let angles: Vec<f64> = (0..=400)
            .map(|k| PI * 10_f64.powf(f64::from(k - 400) / 80.0))
            .collect();
        let points = refined(&curve, &angles)?;
        let turned_rad = turn_rad(points.iter().map(|point| point.value));
        Some(unstable_poles(open, turned_rad))
    }

    /// L = k/(z - 1): the pole of the closed loop is 1 - k, stable for 0 < k < 2.
    #[test]
    fn integrator_is_stable_up_to_twice_the_rate() {
        for (k, unstable) in [(0.5, 0), (1.9, 0), (2.1, 1), (-0.1, 1)] {
            let found = count(poles(1, 0), &|z| (z - 1.0).inv() * k);
            assert_eq!(found, Some(unstable), "{k}");
        }
    }

    /// L = k z^-n: the poles are the n-th roots of -k, all of magnitude |k|^(1/n).
    #[test]
    fn delay_has_as_many_unstable_poles_as_ticks() {
        for (k, unstable) in [(0.9, 0), (-0.9, 0), (1.1, 30), (-1.1, 30)] {
            let found = count(poles(0, 0), &|z| z.powi(-30) * k);
            assert_eq!(found, Some(unstable), "{k}");
        }
    }

    /// L = k/(z - 2): the pole of the closed loop is 2 - k.
    #[test]
    fn unstable_open_loop_is_stabilised_by_its_encirclement() {
        for (k, unstable) in [(0.5, 1), (1.5, 0), (2.5, 0), (3.5, 1)] {
            let found = count(poles(0, 1), &|z| (z - 2.0).inv() * k);
            assert_eq!(found, Some(unstable), "{k}");
        }
    }

    #[test]
    fn curve_through_the_critical_point_has_no_count() {
        // L = -1 at w = 1 rad.
        let curve = |angle: f64| Complex::new(angle - 1.0, 0.0);
        assert!(refined(&curve, &[0.1, 3.0]).is_none());
    }
}
