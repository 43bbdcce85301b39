//! The Nyquist plot.

use std::f64::consts::TAU;

use bench::identify::{Frf, Unit};
use bench::report::{Curve, Trace, nyquist_svg};
use nalgebra::Complex;

use crate::pictures::flat;
use crate::svg;

const BLUE: &str = "#0072B2";

/// Circles of confidence of a measured response: a sample in the legend has four corners, they have more.
fn circles(frf: &Frf) -> usize {
    let measured = [Trace {
        name: "measured",
        curve: Curve::Measured(frf),
    }];
    let svg = nyquist_svg(Unit::MetresPerAmpere, &measured, None, "Nyquist", "").unwrap();
    svg::points(&svg, "polygon", BLUE)
        .iter()
        .filter(|outline| outline.len() > 10)
        .count()
}

#[test]
fn draws_overlapping_confidence_circles_once() {
    let still = Frf {
        magnitude_sigma: vec![1.5e-5; 100],
        ..flat()
    };
    assert_eq!(circles(&still), 1, "more would hide the curve");
    // A hundred points around the origin, of which every second can have a circle: they are 0.126 apart, with radii of 2.45 sigma = 0.049.
    let response = (0..100)
        .map(|k| Complex::from_polar(1.5e-4, TAU * f64::from(k) / 100.0))
        .collect();
    assert_eq!(
        circles(&Frf {
            magnitude_sigma: vec![3e-6; 100],
            response,
            ..flat()
        }),
        50
    );
}
