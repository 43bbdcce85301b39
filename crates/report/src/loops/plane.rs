//! What the Nyquist plots of L have in common, and horizontal lines over frequency.

use std::f64::consts::TAU;

use crate::chart::colours::{GREY, INK};
use crate::chart::{Chart, Pen, Scale, Symbol};

/// The critical point.
pub(super) const CRITICAL: (f64, f64) = (-1.0, 0.0);
/// Corners of a circle.
const CIRCLE_CORNERS: usize = 120;

/// The plane of L with equal scales, from these ends of its axes.
pub(super) fn plane(heading: &str, real: (f64, f64), imaginary: (f64, f64)) -> Chart {
    let x = Scale::linear("Real part of L").within(real.0, real.1);
    let y = Scale::linear("Imaginary part of L").within(imaginary.0, imaginary.1);
    Chart::new(heading, x, y).equal()
}

/// Adds |L| = 1, with this name in the legend.
pub(super) fn with_unit_circle(chart: Chart, name: &str) -> Chart {
    chart.line(name, Pen::dotted(GREY), circle((0.0, 0.0), 1.0))
}

/// Adds -1.
pub(super) fn with_critical_point(chart: Chart) -> Chart {
    chart.points("-1", INK, Symbol::Cross, vec![CRITICAL])
}

/// A closed circle, fine enough for a large plot.
pub(super) fn circle((x, y): (f64, f64), radius: f64) -> Vec<(f64, f64)> {
    let corner = |k: usize| {
        let (sine, cosine) = libm::sincos(TAU * k as f64 / CIRCLE_CORNERS as f64);
        (x + radius * cosine, y + radius * sine)
    };
    (0..=CIRCLE_CORNERS).map(corner).collect()
}

/// A horizontal line from the first to the last of some frequencies.
pub(super) fn level(frequency_hz: &[f64], value: f64) -> Vec<(f64, f64)> {
    let ends = frequency_hz.first().into_iter().chain(frequency_hz.last());
    ends.map(|frequency_hz| (*frequency_hz, value)).collect()
}
