//! Unwrapping of the phase.

use std::f64::consts::TAU;

use bench_identify::{Frf, FrfPoint, Unit};
use bench_report::phase::{is_ambiguous, offset_deg, unwrapped_deg};
use bench_report::{Trace, bode_svg, has_ambiguous_phase};
use nalgebra::Complex;

use crate::report::pictures::frequencies;
use crate::report::svg;

#[test]
fn unwraps_a_falling_phase() {
    let wrapped = [0.0, -90.0, -170.0, 170.0, 90.0, 0.0, -90.0, -179.0, 179.0];
    let unwrapped = [
        0.0, -90.0, -170.0, -190.0, -270.0, -360.0, -450.0, -539.0, -541.0,
    ];
    assert_eq!(unwrapped_deg(&wrapped, &[true; 9]), unwrapped);
}

#[test]
fn unwraps_a_rising_phase() {
    assert_eq!(
        unwrapped_deg(&[90.0, 170.0, -170.0, -90.0], &[true; 4]),
        [90.0, 170.0, 190.0, 270.0]
    );
}

#[test]
fn noise_in_a_deep_notch_adds_no_turn() {
    // Unwrapped point by point, 120, -120 and 0 would add one turn.
    let wrapped = [-10.0, -10.0, 120.0, -120.0, -15.0, -15.0];
    let valid = [true, true, false, false, true, true];
    assert_eq!(unwrapped_deg(&wrapped, &valid)[4..], [-15.0, -15.0]);
    assert_eq!(unwrapped_deg(&wrapped, &[true; 6])[4..], [345.0, 345.0]);
}

#[test]
fn keeps_first_valid_phase() {
    assert_eq!(
        unwrapped_deg(&[-160.0, 30.0, 5.0], &[false, true, true]),
        [200.0, 30.0, 5.0]
    );
    assert_eq!(unwrapped_deg(&[], &[]), Vec::<f64>::new());
}

#[test]
fn shifts_a_curve_by_whole_turns_to_match_another() {
    let reference = [(1.0, 0.0), (10.0, -200.0), (20.0, -340.0)];
    assert_eq!(
        offset_deg(&[(10.0, 160.0), (15.0, 100.0), (20.0, 20.0)], &reference),
        -360.0
    );
    // A single outlier does not decide. Without common frequencies the curve is not moved.
    assert_eq!(
        offset_deg(&[(10.0, 520.0), (11.0, -190.0), (12.0, -200.0)], &reference),
        0.0
    );
    assert_eq!(offset_deg(&[(30.0, 160.0)], &reference), 0.0);
}

#[test]
fn responses_that_differ_by_a_turn_above_the_lowest_decade_keep_their_start() {
    // The phase of S goes from 90 degrees to 0, that of T from 0 to below -540: they differ by a turn at most frequencies, but
    // not at the lowest.
    let s: Vec<(f64, f64)> = (0..40)
        .map(|k| (f64::from(1 + k), 90.0 / f64::from(1 + k)))
        .collect();
    let t: Vec<(f64, f64)> = (0..40)
        .map(|k| (f64::from(1 + k), -18.0 * f64::from(k)))
        .collect();
    assert_eq!(offset_deg(&t, &s), 0.0);
}

/// A stage with three modes, G = sum of r/(s^2 + 2 zeta w s + w^2), the signs of the residues +, -, +: the last two modes are close, and
/// a CNMP pair of zeros lies between them.
fn stage(frequency_hz: f64) -> Complex<f64> {
    let s = Complex::new(0.0, TAU * frequency_hz);
    let modes = [
        (29.3, 0.47, 0.009),
        (82.1, -0.31, 0.004),
        (85.8, 0.35, 0.004),
    ];
    let terms = modes.map(|(hz, residue, zeta)| {
        let w = TAU * hz;
        (s * s + s * (2.0 * zeta * w) + w * w).inv() * residue
    });
    terms.iter().sum()
}

/// The response of this stage with the noise of a good measurement, at frequencies evenly spaced on a logarithmic axis.
fn measured(low_hz: f64, high_hz: f64, count: usize) -> Frf {
    let mut frf = Frf::default();
    for frequency_hz in frequencies(low_hz, high_hz, count) {
        let response = stage(frequency_hz);
        let added = frf.push(FrfPoint {
            frequency_hz,
            response,
            coherence: 0.9999,
            variance: 1e-4 * response.norm_sqr(),
            resolution_hz: 0.05,
        });
        assert!(added);
    }
    frf
}

/// The phase is 0 at low frequencies, and each mode with its damping takes 180 degrees.
#[test]
fn phase_of_a_dense_chirp_is_unwrapped() {
    let dense = measured(20.0, 120.0, 6000);
    assert!(!has_ambiguous_phase(&dense));
    let svg = bode_svg(
        Unit::MetresPerAmpere,
        &[Trace::measured("chirp", &dense)],
        "",
        "",
    )
    .unwrap();
    assert!(!svg.contains("not unwrapped"));
}

/// From 26 to 92 Hz in 20 steps, 6.9 % apart: a mode of 0.4 to 0.9 % damping turns the phase by nearly 180 degrees between two steps.
#[test]
fn phase_of_a_sparse_stepped_sine_is_shown_wrapped() {
    let sparse = measured(26.0, 92.0, 20);
    assert!(has_ambiguous_phase(&sparse));
    let grid_hz = frequencies(26.0, 92.0, 3000);
    let model: Vec<Complex<f64>> = grid_hz.iter().map(|f| stage(*f)).collect();
    let traces = [
        Trace::measured("stepped sine", &sparse),
        Trace::model("model", &grid_hz, &model),
    ];
    let svg = bode_svg(Unit::MetresPerAmpere, &traces, "", "").unwrap();
    assert!(svg.contains("not unwrapped"));
    let ticks = svg::words(&svg);
    let is_tick = |text: &str| ticks.iter().any(|words| words.text == text);
    assert!(is_tick("180") && is_tick("\u{2212}180"));
    assert!(!is_tick("\u{2212}360") && !is_tick("360"));
}

#[test]
fn phase_is_ambiguous_where_neighbours_differ_by_more_than_120_degrees_or_few_are_known() {
    for (phases, valid, ambiguous) in [
        (vec![0.0, -119.0, 122.0], vec![true; 3], false),
        (vec![0.0, -121.0], vec![true; 2], true),
        (vec![0.0, 150.0, -5.0], vec![true, false, true], false),
        (
            vec![0.0, 9.0, 9.0, -5.0, 0.0],
            vec![true, false, false, false, true],
            true,
        ),
        (
            vec![0.0, 9.0, 99.0, -99.0],
            vec![true, true, false, false],
            false,
        ),
        (vec![0.0, 9.0], vec![false, false], true),
        (vec![], vec![], false),
    ] {
        assert_eq!(
            is_ambiguous(&phases, &valid),
            ambiguous,
            "{phases:?} {valid:?}"
        );
    }
}
