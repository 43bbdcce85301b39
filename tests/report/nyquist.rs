//! The Nyquist plot.

use std::f64::consts::TAU;

use bench_identify::{Frf, Unit};
use bench_report::{Curve, Trace, coherence_svg, nyquist_svg};
use nalgebra::Complex;

use crate::report::pictures::flat;
use crate::report::svg;

const BLUE: &str = "#0072B2";

/// Number of confidence circles of a measured response. They have more corners than the four of the legend sample.
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
    let constant = Frf {
        magnitude_sigma: vec![1.5e-5; 100],
        ..flat()
    };
    assert_eq!(circles(&constant), 1, "all circles coincide");
    // 100 points on a circle around the origin, 0.063 of its radius apart. The confidence radius of 2.45 sigma is 0.049 of it, so that
    // circles at every second point, 0.126 apart, do not overlap.
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

/// Lines of a multisine that are farther apart than their resolution: no stroke joins them.
#[test]
fn lines_between_gaps_are_drawn_as_dots() {
    let apart = Frf {
        resolution_hz: vec![1e-6; 100],
        magnitude_sigma: vec![1e-9; 100],
        response: (0..100)
            .map(|k| Complex::from_polar(1.5e-4, TAU * f64::from(k) / 100.0))
            .collect(),
        ..flat()
    };
    let measured = [Trace {
        name: "measured",
        curve: Curve::Measured(&apart),
    }];
    let nyquist = nyquist_svg(Unit::MetresPerAmpere, &measured, None, "Nyquist", "").unwrap();
    let coherence = coherence_svg(&apart, "Coherence", "").unwrap();
    // Dots of labelled frequencies are larger.
    let dots = |svg: &str| svg.matches(" r=\"20\"").count();
    assert_eq!(dots(&nyquist), 100);
    // A coherence of 1 has no place in the logarithmic panel of 1 - coherence.
    assert_eq!(dots(&coherence), 100);
}
