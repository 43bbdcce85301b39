//! Bode and Nyquist charts.

use nalgebra::Complex;

use bench_report::colours::{GREY, INK, VERMILION};
use bench_report::phase::unwrapped_deg;
use bench_report::{Chart, Pen, Scale, Symbol};

/// A named response over frequency.
#[derive(Clone)]
pub(crate) struct Curve {
    /// For the legend.
    pub name: String,
    /// How it is drawn.
    pub pen: Pen,
    /// Frequency (rad/s or Hz) and value.
    pub points: Vec<(f64, Complex<f64>)>,
    /// Phase of the first point, where it is known from lower frequencies.
    first_deg: Option<f64>,
}

impl Curve {
    pub fn new(name: &str, pen: Pen, points: Vec<(f64, Complex<f64>)>) -> Curve {
        Curve {
            name: name.into(),
            pen,
            points,
            first_deg: None,
        }
    }

    /// Frequencies in hertz instead of rad/s.
    pub fn in_hertz(mut self) -> Curve {
        self.points
            .iter_mut()
            .for_each(|point| point.0 /= std::f64::consts::TAU);
        self
    }

    /// The part of the curve between two frequencies, both included; its phase continues from lower frequencies.
    pub fn part(&self, low: f64, high: f64) -> Curve {
        let inside = |w: f64| (low..=high).contains(&w);
        let mut points: Vec<_> = self
            .points
            .iter()
            .filter(|(w, _)| inside(*w))
            .copied()
            .collect();
        let first_deg = self
            .phase_deg()
            .into_iter()
            .find(|(w, _)| inside(*w))
            .map(|(_, phase)| phase);
        if let Some(value) = self
            .between(low)
            .filter(|_| points.first().is_some_and(|point| point.0 > low))
        {
            points.insert(0, (low, value));
        }
        if let Some(value) = self
            .between(high)
            .filter(|_| points.last().is_some_and(|point| point.0 < high))
        {
            points.push((high, value));
        }
        Curve {
            first_deg,
            ..Curve::new(&self.name, self.pen, points)
        }
    }

    /// On the straight line between the two points around a frequency.
    fn between(&self, w: f64) -> Option<Complex<f64>> {
        let after = self.points.partition_point(|point| point.0 <= w);
        let (before, after) = (
            self.points.get(after.checked_sub(1)?)?,
            self.points.get(after)?,
        );
        Some(before.1 + (after.1 - before.1) * ((w - before.0) / (after.0 - before.0)))
    }

    pub fn magnitude(&self) -> Vec<(f64, f64)> {
        self.points
            .iter()
            .map(|(w, value)| (*w, value.norm()))
            .collect()
    }

    /// Unwrapped from the lowest frequency on, where it is in (-270, 90] degrees: a double integrator begins at -180.
    pub fn phase_deg(&self) -> Vec<(f64, f64)> {
        let wrapped: Vec<f64> = self
            .points
            .iter()
            .map(|(_, value)| value.arg().to_degrees())
            .collect();
        let phases = unwrapped_deg(&wrapped, &vec![true; wrapped.len()]);
        let turn = match (phases.first(), self.first_deg) {
            (Some(first), Some(known)) => 360.0 * ((first - known) / 360.0).round(),
            (Some(first), None) if *first > 90.0 => 360.0,
            _ => 0.0,
        };
        self.points
            .iter()
            .zip(phases)
            .map(|((w, _), phase)| (*w, phase - turn))
            .collect()
    }

    /// The curve in the complex plane.
    pub fn polar(&self) -> Vec<(f64, f64)> {
        self.points
            .iter()
            .map(|(_, value)| (value.re, value.im))
            .collect()
    }
}

/// Magnitude and phase, for two rows; the names are in the legend of the first.
pub(crate) fn bode(
    heading: &str,
    frequency: &str,
    magnitude: &str,
    curves: &[Curve],
) -> (Chart, Chart) {
    let range = |scale: Scale| match ends(curves) {
        Some((low, high)) => scale.within(low, high),
        None => scale,
    };
    let mut gains = Chart::new(
        heading,
        range(Scale::logarithmic(frequency)),
        Scale::logarithmic(magnitude),
    );
    let mut phases = Chart::new(
        "",
        range(Scale::logarithmic(frequency)),
        Scale::degrees("Phase (deg)"),
    );
    for curve in curves {
        gains = gains.line(&curve.name, curve.pen, curve.magnitude());
        phases = phases.line("", curve.pen, curve.phase_deg());
    }
    (gains, phases)
}

fn ends(curves: &[Curve]) -> Option<(f64, f64)> {
    let firsts = curves
        .iter()
        .filter_map(|curve| curve.points.first())
        .map(|point| point.0);
    let lasts = curves
        .iter()
        .filter_map(|curve| curve.points.last())
        .map(|point| point.0);
    let (low, high) = (
        firsts.fold(f64::INFINITY, f64::min),
        lasts.fold(f64::NEG_INFINITY, f64::max),
    );
    (low < high).then_some((low, high))
}

/// A Nyquist chart around the origin: `re` and `im` are the ends of the axes, widened so that circles are round.
pub(crate) fn nyquist(heading: &str, re: (f64, f64), im: (f64, f64), what: &str) -> Chart {
    let (low, high) = (f64::min(re.0, -1e9), f64::max(re.1, 1e9));
    Chart::new(
        heading,
        Scale::linear(&format!("Real part of {what}")).within(re.0, re.1),
        Scale::linear(&format!("Imaginary part of {what}")).within(im.0, im.1),
    )
    .equal()
    .line("", Pen::solid(GREY).thin(), vec![(low, 0.0), (high, 0.0)])
    .line("", Pen::solid(GREY).thin(), vec![(0.0, low), (0.0, high)])
}

/// Adds the critical point and the unit circle.
pub(crate) fn critical(chart: Chart) -> Chart {
    chart
        .line("|L| = 1", Pen::dotted(GREY), circle((0.0, 0.0), 1.0))
        .points("−1", VERMILION, Symbol::Cross, vec![(-1.0, 0.0)])
}

/// Adds the origin, because the corner between two resonance circles may lie on either side of it.
pub(crate) fn origin(chart: Chart) -> Chart {
    chart.points("origin", INK, Symbol::Dot, vec![(0.0, 0.0)])
}

/// A circle as a line.
pub(crate) fn circle(centre: (f64, f64), radius: f64) -> Vec<(f64, f64)> {
    let at = |k: i32| {
        let (sine, cosine) = f64::from(k).to_radians().sin_cos();
        (centre.0 + radius * cosine, centre.1 + radius * sine)
    };
    (0..=360).map(at).collect()
}
