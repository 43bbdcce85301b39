//! A measured response as a smooth curve with its noise.
//!
//! The extremes and crossings of a noisy curve are biased: the smallest one of many noisy distances from -1 is too small. At each
//! measured frequency the response is therefore a parabola over its neighbours (local regression). Its half-width in points is
//! half of the largest one at which the residuals are noise: the error of a parabola grows with the fourth power of the width, so
//! that a misfit too small to be seen over the whole width is below 0.2 sigma in half of it. On a resonance that is narrower than
//! that, the measured points themselves remain. Between two frequencies the curve is the cubic of both values and slopes.
//!
//! Neighbouring points of an estimator with the noise bandwidth B (`resolution_rad_s`) at a spacing d have correlated errors: the
//! mean over a width W has the variance S/W, one point S/B, with S the power density of the noise. The variance of a mean of
//! independent points is therefore multiplied by B/d, where that is above 1.

use nalgebra::Complex;

use super::point::ResponsePoint;
use super::quadratic::{self, Quadratic};

/// Half-widths that are tried, in points.
const HALF_WIDTHS: [usize; 13] = [1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96];
/// The misfit may exceed its mean by this many standard deviations.
const MISFIT_SIGMAS: f64 = 2.5;
/// Parameters of a parabola.
const PARAMETERS: f64 = 3.0;
/// Relative standard deviation of a point whose own is smaller: rounding.
const ROUNDING: f64 = 1e-12;

/// A measured response between its first and its last frequency.
#[derive(Clone, Debug)]
pub(super) struct SmoothResponse(Vec<Node>);

/// The curve at a measured frequency.
#[derive(Clone, Copy, Debug)]
struct Node {
    omega_rad_s: f64,
    value: Complex<f64>,
    /// dH/dw.
    slope: Complex<f64>,
    /// E|error|^2.
    variance: f64,
}

impl SmoothResponse {
    /// The curve through points of rising frequency; `None` if there are less than three, or if they are not finite.
    pub fn new(points: &[ResponsePoint]) -> Option<SmoothResponse> {
        let points: Vec<ResponsePoint> = points.iter().map(with_rounding).collect();
        let nodes = (0..points.len()).map(|k| node(&points, k));
        let nodes: Vec<Node> = nodes.collect::<Option<_>>()?;
        (nodes.len() > 2).then_some(SmoothResponse(nodes))
    }

    /// The measured frequencies in rad/s.
    pub fn frequencies(&self) -> impl Iterator<Item = f64> + '_ {
        self.0.iter().map(|node| node.omega_rad_s)
    }

    /// The first and the last frequency in rad/s.
    pub fn band_rad_s(&self) -> (f64, f64) {
        (self.0[0].omega_rad_s, self.0[self.0.len() - 1].omega_rad_s)
    }

    /// The response; beyond an end of the band the one at that end.
    pub fn at(&self, omega_rad_s: f64) -> Complex<f64> {
        let (from, to, t) = self.place(omega_rad_s);
        let width = to.omega_rad_s - from.omega_rad_s;
        let (u, double) = (1.0 - t, 2.0 * t);
        from.value * ((1.0 + double) * u * u)
            + from.slope * (width * t * u * u)
            + to.value * ((3.0 - double) * t * t)
            - to.slope * (width * t * t * u)
    }

    /// E|error of the response|^2.
    pub fn variance(&self, omega_rad_s: f64) -> f64 {
        let (from, to, t) = self.place(omega_rad_s);
        from.variance + t * (to.variance - from.variance)
    }

    /// The nodes around a frequency, and its place between them, 0 to 1.
    fn place(&self, omega_rad_s: f64) -> (&Node, &Node, f64) {
        let after = self
            .0
            .partition_point(|node| node.omega_rad_s < omega_rad_s);
        let after = after.clamp(1, self.0.len() - 1);
        let (from, to) = (&self.0[after - 1], &self.0[after]);
        let t = (omega_rad_s - from.omega_rad_s) / (to.omega_rad_s - from.omega_rad_s);
        (from, to, t.clamp(0.0, 1.0))
    }
}

/// A point without noise still has rounding errors.
fn with_rounding(point: &ResponsePoint) -> ResponsePoint {
    let least = (ROUNDING * point.response.norm()).powi(2);
    ResponsePoint {
        variance: point.variance.max(least).max(f64::MIN_POSITIVE),
        ..*point
    }
}

/// The curve at point `k`: the parabola over half of the largest half-width that fits.
fn node(points: &[ResponsePoint], k: usize) -> Option<Node> {
    let fits = |half: &&usize| parabola(points, k, **half).is_some_and(|p| p.describes());
    let largest = HALF_WIDTHS.iter().take_while(fits).last();
    let half = largest.map_or(1, |half| (half / 2).max(1));
    let parabola = parabola(points, k, half)?;
    Some(Node {
        omega_rad_s: points[k].omega_rad_s,
        value: parabola.fit.value,
        slope: parabola.fit.slope,
        variance: parabola.fit.variance * parabola.correlation,
    })
}

/// A parabola over neighbouring points.
struct Parabola {
    fit: Quadratic,
    points: f64,
    /// B/d, at least 1.
    correlation: f64,
}

impl Parabola {
    /// Whether the residuals are noise. Of n points with correlated errors, n d/B are independent.
    fn describes(&self) -> bool {
        let freedom = (self.points - PARAMETERS * self.correlation).max(0.0);
        let deviation = (self.points * self.correlation).sqrt();
        self.fit.misfit <= freedom + MISFIT_SIGMAS * deviation
    }
}

/// The parabola over `half` points to either side of point `k`, three at least.
fn parabola(points: &[ResponsePoint], k: usize, half: usize) -> Option<Parabola> {
    let last = points.len().checked_sub(1).filter(|last| *last >= 2)?;
    let from = k.saturating_sub(half).min(last - 2);
    let to = (k + half).max(from + 2).min(last);
    let within = &points[from..=to];
    let fit = quadratic::fit(within, points[k].omega_rad_s)?;
    let spacing = (points[to].omega_rad_s - points[from].omega_rad_s) / (to - from) as f64;
    Some(Parabola {
        fit,
        points: within.len() as f64,
        correlation: (points[k].resolution_rad_s / spacing).max(1.0),
    })
}
