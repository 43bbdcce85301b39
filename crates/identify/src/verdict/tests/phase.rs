//! The band of the phase criterion, and the magnitude beyond the data.

use nalgebra::Complex;

use super::BODE_ERROR_DEG;
use super::stage::{Case, Stage, all_pass_lag_deg, pair};
use crate::verdict::PhaseDrop;

fn phase_drop(case: &Case) -> PhaseDrop {
    case.verdict().phase_drop.expect("two modes")
}

#[test]
fn real_zero_above_the_modes_does_not_extend_the_band_of_the_phase() {
    // 150 rad/s, a real zero of the right half plane; the modes end at 110 rad/s, and the data within 1.1 of that at 120.5 rad/s.
    let re = 150.0;
    let drop = phase_drop(&Case::of(&Stage::with_real_zero(re)));
    let closed_form = 2.0 * ((120.5_f64 / re).atan() - (50.5_f64 / re).atan()).to_degrees();
    // The zero is computed to some 1e-13.
    assert!((drop.predicted_deg - closed_form).abs() < 1e-7, "{drop:?}");
    assert!(drop.deviation_deg() < BODE_ERROR_DEG, "{drop:?}");
}

#[test]
fn datum_at_half_of_the_first_mode_is_the_first_of_the_band() {
    let stage = Stage::with_pair(3.0);
    let mut case = Case::of(&stage);
    let below = case.frf_data.iter_mut().find(|d| d.omega_rad_s() > 49.0);
    let datum = below.expect("the datum at 49.5 rad/s");
    *datum = stage.datum(50.0);
    assert_eq!(datum.omega_rad_s(), 50.0);
    let drop = phase_drop(&case);
    let closed_form = all_pass_lag_deg(pair(3.0), 50.0, 120.5);
    assert!((drop.predicted_deg - closed_form).abs() < 1e-7, "{drop:?}");
}

#[test]
fn zeros_on_the_left_predict_no_phase_drop() {
    let drop = phase_drop(&Case::of(&Stage::with_pair(-0.3)));
    assert_eq!(drop.predicted_deg, 0.0);
    assert!(drop.drop_deg.abs() < BODE_ERROR_DEG, "{drop:?}");
}

#[test]
fn mode_below_the_data_has_its_part_of_the_minimum_phase() {
    // The data begin at 62.5 rad/s, just above the mode at 60 rad/s; its side falls steeply there, and the magnitude below is that of
    // the fit.
    let zero = pair(3.0);
    let mut case = Case::of(&Stage::with_mode_below(zero.re));
    case.frf_data.retain(|datum| datum.omega_rad_s() > 62.0);
    let drop = phase_drop(&case);
    let closed_form = all_pass_lag_deg(zero, 62.5, 120.5);
    assert!((drop.predicted_deg - closed_form).abs() < 1e-7, "{drop:?}");
    assert!(drop.deviation_deg() < BODE_ERROR_DEG, "{drop:?}");
}

#[test]
fn mode_above_the_data_has_its_part_of_the_minimum_phase() {
    // The data end at 107.5 rad/s, below the mode at 110 rad/s.
    let zero = pair(3.0);
    let mut case = Case::of(&Stage::with_mode_below(zero.re));
    case.frf_data.retain(|datum| datum.omega_rad_s() < 108.0);
    case.up_to_rad_s = 108.0;
    let drop = phase_drop(&case);
    let closed_form = all_pass_lag_deg(zero, 30.5, 107.5);
    assert!((drop.predicted_deg - closed_form).abs() < 1e-7, "{drop:?}");
    assert!(drop.deviation_deg() < BODE_ERROR_DEG, "{drop:?}");
}

#[test]
fn phase_needs_two_significant_data_in_its_band() {
    // From 50 to 121 rad/s only the given number of data is left.
    let drop_of = |data: usize| {
        let mut case = Case::of(&Stage::with_pair(3.0));
        let first = case.frf_data.iter().position(|d| d.omega_rad_s() > 50.0);
        let after = first.expect("a datum") + data;
        case.frf_data.truncate(after);
        case.verdict().phase_drop
    };
    assert_eq!(drop_of(0), None);
    assert_eq!(drop_of(1), None);
    let drop = drop_of(2).expect("two data");
    let closed_form = all_pass_lag_deg(pair(3.0), 50.5, 51.5);
    assert!((drop.predicted_deg - closed_form).abs() < 1e-7, "{drop:?}");
}

#[test]
fn data_of_noise_between_significant_ones_have_the_phase_of_the_fit() {
    // Wrong data, marked as noise, around the zeros: three of 220, at 104.5 to 106.5 rad/s.
    let zero = pair(3.0);
    let mut case = Case::of(&Stage::with_pair(zero.re));
    for datum in &mut case.frf_data {
        if (104.0..107.0).contains(&datum.omega_rad_s()) {
            datum.response *= Complex::new(0.0, 3.0);
            datum.variance = datum.response.norm_sqr();
        }
    }
    let drop = phase_drop(&case);
    let closed_form = all_pass_lag_deg(zero, 50.5, 120.5);
    assert!((drop.predicted_deg - closed_form).abs() < 1e-7, "{drop:?}");
    assert!(drop.deviation_deg() < BODE_ERROR_DEG, "{drop:?}");
}
