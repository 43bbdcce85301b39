use bench::report::phase::{offset_deg, unwrapped_deg};

#[test]
fn a_falling_phase_runs_on_past_minus_180_degrees() {
    let wrapped = [0.0, -90.0, -170.0, 170.0, 90.0, 0.0, -90.0, -179.0, 179.0];
    let unwrapped = [
        0.0, -90.0, -170.0, -190.0, -270.0, -360.0, -450.0, -539.0, -541.0,
    ];
    assert_eq!(unwrapped_deg(&wrapped, &[true; 9]), unwrapped);
}

#[test]
fn a_rising_phase_runs_on_past_180_degrees() {
    assert_eq!(
        unwrapped_deg(&[90.0, 170.0, -170.0, -90.0], &[true; 4]),
        [90.0, 170.0, 190.0, 270.0]
    );
}

#[test]
fn noise_in_a_deep_notch_adds_no_turn_to_what_follows() {
    // Followed point by point, 120, -120 and 0 would go round once.
    let wrapped = [-10.0, -10.0, 120.0, -120.0, -15.0, -15.0];
    let trusted = [true, true, false, false, true, true];
    assert_eq!(unwrapped_deg(&wrapped, &trusted)[4..], [-15.0, -15.0]);
    assert_eq!(unwrapped_deg(&wrapped, &[true; 6])[4..], [345.0, 345.0]);
}

#[test]
fn the_first_trusted_phase_stays_where_it_is_and_those_before_follow_it() {
    assert_eq!(
        unwrapped_deg(&[-160.0, 30.0, 5.0], &[false, true, true]),
        [200.0, 30.0, 5.0]
    );
    assert_eq!(unwrapped_deg(&[], &[]), Vec::<f64>::new());
}

#[test]
fn a_curve_that_begins_later_is_put_on_the_turn_of_the_one_that_began_lower() {
    let reference = [(1.0, 0.0), (10.0, -200.0), (20.0, -340.0)];
    assert_eq!(
        offset_deg(&[(10.0, 160.0), (15.0, 100.0), (20.0, 20.0)], &reference),
        -360.0
    );
    // One stray point does not decide, and where nothing overlaps nothing moves.
    assert_eq!(
        offset_deg(&[(10.0, 520.0), (11.0, -190.0), (12.0, -200.0)], &reference),
        0.0
    );
    assert_eq!(offset_deg(&[(30.0, 160.0)], &reference), 0.0);
}
