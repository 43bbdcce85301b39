//! Unwrapping of the phase.

use bench::report::phase::{offset_deg, unwrapped_deg};

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
