//! The map of poles and zeros.

use bench_identify::Unit;
use bench_report::{
    PoleZeroMap, ReportError, StabilityChart, UncertainPoint, pole_zero_svg, stability_svg,
};
use nalgebra::Complex;

use crate::report::pictures::{flat, keep};
use crate::report::svg;

const BLUE: &str = "#0072B2";
const VERMILION: &str = "#D55E00";

fn place(re: f64, im: f64, covariance: [[f64; 2]; 2]) -> UncertainPoint {
    UncertainPoint {
        s: Complex::new(re, im),
        covariance,
    }
}

fn none() -> [[f64; 2]; 2] {
    [[0.0; 2]; 2]
}

/// Three modes, two of them close, with a zero on either side of the imaginary axis between the close ones.
fn map(covariance: [[f64; 2]; 2]) -> PoleZeroMap {
    PoleZeroMap {
        poles: vec![
            place(-1.6, 184.0, none()),
            place(-2.0, 516.0, none()),
            place(-2.1, 539.0, none()),
        ],
        zeros: vec![
            place(-14.9, 530.0, covariance),
            place(10.7, 530.0, covariance),
        ],
        others: vec![place(-3.0, 1700.0, none())],
        up_to_rad_s: 650.0,
    }
}

#[test]
fn closest_pair_ignores_poles_above_the_limit_and_on_the_real_axis() {
    let mut map = map([[1.0, 0.0], [0.0, 1.0]]);
    map.poles.extend([
        place(-5.0, 1700.0, none()),
        place(-5.0, 1701.0, none()),
        place(-4.0, 0.0, none()),
    ]);
    assert_eq!(map.close_pair(), Some((516.0, 539.0)));
    assert_eq!(PoleZeroMap::default().close_pair(), None);
}

#[test]
fn draws_an_ellipse_to_the_scale_of_its_covariance() {
    let svg = pole_zero_svg(&map([[4.0, 0.0], [0.0, 1.0]]), "map", "").unwrap();
    keep("pole-zero.svg", &svg);
    // The zeros are drawn in three maps: twice in the upper row, and enlarged below.
    let areas = |colour| svg::points(&svg, "polygon", colour);
    assert!(areas(VERMILION).len() >= 3 && areas(BLUE).len() >= 3);
    let extent = |outline: &[(f64, f64)]| {
        let of = |part: fn(&(f64, f64)) -> f64| {
            let values: Vec<f64> = outline.iter().map(part).collect();
            values.iter().copied().fold(f64::MIN, f64::max)
                - values.iter().copied().fold(f64::MAX, f64::min)
        };
        (of(|p| p.0), of(|p| p.1))
    };
    // The half-width of the ellipse is k sigma, with sigma = 2 along x and 1 along y. In the enlarged map the axis is within six half-widths
    // of the right zero and is therefore shown: along x the 400 px cover 10.7 + 0.45 k 2 to the left of the zero and 1.45 k 2 to its
    // right; along y the 250 px cover 2.9 k.
    let k = (-2.0 * 0.05f64.ln()).sqrt();
    let width = 400.0 * 4.0 * k / (10.7 + 0.45 * 2.0 * k + 1.45 * 2.0 * k);
    let height = 250.0 * 2.0 / 2.9;
    let ellipses: Vec<(f64, f64)> = areas(VERMILION)
        .iter()
        .filter(|outline| outline.len() > 10)
        .map(|outline| extent(outline))
        .collect();
    // Coordinates are rounded to tenths of a pixel.
    let found = ellipses
        .iter()
        .any(|e| (e.0 / 10.0 - width).abs() < 0.3 && (e.1 / 10.0 - height).abs() < 0.3);
    assert!(found, "{width} x {height}: {ellipses:?}");
}

#[test]
fn draws_zeros_of_singular_covariance_without_ellipse() {
    for covariance in [
        none(),
        [[f64::INFINITY, 0.0], [0.0, f64::INFINITY]],
        [[f64::NAN, 0.0], [0.0, 1.0]],
        [[4.0, 0.0], [0.0, 0.0]],
    ] {
        let svg = pole_zero_svg(&map(covariance), "a <map> & more", "").unwrap();
        assert!(
            !svg.contains("NaN") && !svg.contains("inf") && !svg.contains("<map>"),
            "{covariance:?}"
        );
        assert!(svg.contains("a &lt;map&gt; &amp; more"));
    }
}

#[test]
fn clips_an_ellipse_larger_than_the_map() {
    let svg = pole_zero_svg(&map([[1e8, 9e7], [9e7, 1e8]]), "map", "").unwrap();
    let inside = |(x, y): &(f64, f64)| (0.0..=10_000.0).contains(x) && *y >= 0.0;
    assert!(svg::points(&svg, "polygon", "").concat().iter().all(inside));
}

#[test]
fn draws_an_empty_map_and_rejects_a_chart_without_orders() {
    assert!(
        pole_zero_svg(&PoleZeroMap::default(), "", "")
            .unwrap()
            .contains("imaginary axis")
    );
    let chart = StabilityChart {
        orders: &[],
        fit_hz: &[],
        band_hz: (1.0, 2.0),
        measured: &flat(),
        unit: Unit::MetresPerAmpere,
    };
    assert_eq!(stability_svg(&chart, "", ""), Err(ReportError::NoTrace));
}
