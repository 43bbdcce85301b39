//! The Bode plot of an identification: the residual of the fit.

use bench_identify::{Frf, Unit};
use bench_report::{Identification, MagnitudeAxis, Trace, identification_svg};
use nalgebra::Complex;

use crate::report::pictures::flat;
use crate::report::svg;

const RESIDUAL: &str = "data-name=\"residual of the fit\"";

/// The plot of a flat response of 1.5e-4 m/A with a standard deviation of 1e-6 m/A, and of a fit that differs from it by a part.
fn drawn(difference: f64, magnitude_axis: MagnitudeAxis) -> String {
    let frf = Frf {
        magnitude_sigma: vec![1e-6; 100],
        ..flat()
    };
    let fitted: Vec<Complex<f64>> = frf.response.iter().map(|h| h + difference).collect();
    let plot = Identification {
        unit: Unit::MetresPerAmpere,
        magnitude_axis,
        measured: &frf,
        curves: &[Trace::fit("fit", &frf.frequency_hz, &fitted)],
        fitted: Some(&fitted),
    };
    identification_svg(&plot, "Stage", "").unwrap()
}

/// Lower and upper end of the vertical axis of the panel of the residual.
fn axis(svg: &str) -> (String, f64, f64) {
    let before = svg.split(RESIDUAL).next().unwrap();
    let plot = before.rsplit("<g class=\"plot\"").next().unwrap();
    let tag = plot.lines().next().unwrap();
    let text = svg::attribute(tag, "data-y").unwrap();
    let words: Vec<&str> = text.split(' ').collect();
    let number = |k: usize| words[k].parse().unwrap();
    (words[0].into(), number(1), number(2))
}

/// Quantiles of the Rayleigh distribution: noise alone leaves 0.225e-6 to 2.716e-6 m/A.
#[test]
fn residual_panel_covers_the_residual_and_the_band_of_the_noise() {
    for (difference, low, high) in [
        (1e-5, 0.225e-6, 1e-5),
        (1e-6, 0.225e-6, 2.716e-6),
        (1e-7, 1e-7, 2.716e-6),
    ] {
        let (kind, bottom, top) = axis(&drawn(difference, MagnitudeAxis::Logarithmic));
        assert_eq!(kind, "log");
        assert!(bottom < low && bottom > low / 10.0, "{bottom} {low}");
        assert!(top > high && top < 10.0 * high, "{top} {high}");
    }
}

#[test]
fn residual_panel_is_in_decibels_with_such_an_axis() {
    let svg = drawn(1e-5, MagnitudeAxis::Decibels);
    // 20 lg 1e-5 = -100 dB, 20 lg 0.225e-6 = -132.96 dB.
    let (kind, bottom, top) = axis(&svg);
    assert_eq!(kind, "linear");
    assert!((-153.0..-133.0).contains(&bottom) && (-100.0..-80.0).contains(&top));
    let words = svg::words(&svg);
    for label in ["Magnitude (dB re 1 m/A)", "|H − fit| (dB re 1 m/A)"] {
        assert!(words.iter().any(|w| w.text == label), "{label}");
    }
}

#[test]
fn residual_panel_is_left_out_without_a_fit() {
    let frf = flat();
    let plot = Identification {
        unit: Unit::Bare,
        magnitude_axis: MagnitudeAxis::Logarithmic,
        measured: &frf,
        curves: &[],
        fitted: None,
    };
    let svg = identification_svg(&plot, "Stage", "").unwrap();
    assert!(!svg.contains(RESIDUAL) && svg.contains("Coherence"));
}
