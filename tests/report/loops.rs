//! Plots of a loop by its model.

use std::f64::consts::TAU;

use bench_control::{Crossing, LoopMargins, Margins};
use bench_report::{LoopPlot, loop_bode_svg};
use nalgebra::Complex;

use crate::report::pictures::frequencies;
use crate::report::svg;

const VERMILION: &str = "#D55E00";
const CROSSOVER_HZ: f64 = 10.0;

/// Of |L| = 10/f the only crossing, at a phase of -500 degrees: 40 degrees above -540.
fn margins() -> Margins {
    Margins {
        loop_margins: LoopMargins {
            crossover_rad_s: Some(TAU * CROSSOVER_HZ),
            phase_margin_deg: Some(40.0),
            modulus_margin: 0.5,
            sensitivity_peak_db: 6.0,
            sensitivity_peak_rad_s: TAU * CROSSOVER_HZ,
            ..LoopMargins::default()
        },
        stable: true,
        crossings: vec![Crossing {
            rad_s: TAU * CROSSOVER_HZ,
            phase_margin_deg: 40.0,
        }],
        ..Margins::default()
    }
}

/// The phase margin at a phase below -360 degrees is drawn to -540 degrees, not to -180.
#[test]
fn phase_margin_reaches_to_the_nearest_turn_of_minus_180_degrees() {
    let frequency_hz = frequencies(1.0, 100.0, 1000);
    let loop_gain: Vec<Complex<f64>> = frequency_hz
        .iter()
        .map(|f| Complex::from_polar(10.0 / f, (-100.0 - 400.0 * f.log10()).to_radians()))
        .collect();
    let plot = LoopPlot {
        frequency_hz: &frequency_hz,
        loop_gain: &loop_gain,
        margins: &margins(),
        min_modulus_margin: 0.0,
    };
    let svg = loop_bode_svg(&plot, "Loop", "").unwrap();
    let words = svg::words(&svg);
    let label = "phase margin 40.0° at 10.00 Hz";
    assert!(words.iter().any(|w| w.text == label));
    let panel = svg.split("data-y=\"degrees ").nth(1).expect("the phases");
    let ends: Vec<f64> = panel
        .split('"')
        .next()
        .map(|text| text.split(' ').map(|word| word.parse().unwrap()).collect())
        .unwrap();
    let before = svg.split("data-y=\"degrees ").next().unwrap();
    let tag = before.rsplit("<g ").next().unwrap();
    let sides: Vec<f64> = svg::attribute(&format!(" {tag}"), "data-box")
        .unwrap()
        .split(' ')
        .map(|word| word.parse().unwrap())
        .collect();
    let place = |deg: f64| sides[3] + (deg - ends[0]) / (ends[1] - ends[0]) * (sides[1] - sides[3]);
    let lines = svg::points(panel, "polyline", VERMILION);
    let drawn = lines.iter().find(|line| line[0].0 == line[1].0);
    let (from, to) = (drawn.unwrap()[0].1, drawn.unwrap()[1].1);
    // Places are rounded to tenths of a pixel, one unit.
    assert!((from - place(-500.0)).abs() <= 2.0 && (to - place(-540.0)).abs() <= 2.0);
}
