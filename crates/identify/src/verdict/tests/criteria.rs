//! The criteria alone, with zeros and phase drops made by hand.

use nalgebra::{Complex, DMatrix};

use super::stage::{Case, Stage, index};
use crate::modal::Parameter;
use crate::verdict::sign_groups::signs_of;
use crate::verdict::{
    Cnmp, NO_CNMP, NO_OPPOSITE_NEIGHBOURS, PhaseDrop, UncertainZero, evaluate, only_of_the_chain,
    uncertain_side, zeros_of_the_stage,
};
use bench_plant::zeros::ZeroKind;

const OPPOSITE: [f64; 2] = [1.0, -1.0];

/// A CNMP zero at 1 + 100 j with a standard deviation of its real part.
fn cnmp_zero(sigma: f64) -> UncertainZero {
    UncertainZero {
        s: Complex::new(1.0, 100.0),
        covariance: [[sigma * sigma, 0.0], [0.0, 0.0]],
        rhp_probability: 1.0,
        kind: ZeroKind::Cnmp,
        difference: Complex::new(0.0, 0.0),
    }
}

fn left_zero() -> UncertainZero {
    UncertainZero {
        s: Complex::new(-1.0, 100.0),
        kind: ZeroKind::Mmp,
        rhp_probability: 0.0,
        ..cnmp_zero(0.0)
    }
}

fn phase_drop(predicted_deg: f64, excess_deg: f64) -> PhaseDrop {
    PhaseDrop {
        drop_deg: predicted_deg + excess_deg,
        predicted_deg,
        followed_rad_s: (50.0, 200.0),
    }
}

#[test]
fn phase_may_deviate_by_sixty_degrees() {
    let (right, left) = ([cnmp_zero(0.0)], [left_zero()]);
    for (zeros, predicted_deg, decided) in [
        (&right, 350.0, Cnmp::Detected),
        (&left, 0.0, Cnmp::Excluded),
    ] {
        let cnmp_at = |excess_deg: f64| {
            evaluate(
                zeros,
                Some(&OPPOSITE),
                phase_drop(predicted_deg, excess_deg),
            )
            .0
        };
        for near in [0.0, 59.9, 60.0, -59.9, -60.0] {
            assert_eq!(cnmp_at(near), decided, "{near}");
        }
        for far in [60.1, -60.1, 119.0, -119.0, 360.0, f64::NAN] {
            assert_eq!(cnmp_at(far), Cnmp::Undecided, "{far}");
        }
    }
}

#[test]
fn reason_of_a_disagreement_states_both_phase_drops() {
    let (_, why) = evaluate(
        &[cnmp_zero(0.0)],
        Some(&OPPOSITE),
        phase_drop(350.0, -340.0),
    );
    assert!(
        why.contains("predict 350 degrees") && why.contains("the measured response has 10;"),
        "{why}"
    );
}

#[test]
fn reasons_have_no_negative_zero() {
    let of_phases = |predicted_deg: f64, drop_deg: f64| {
        let phase_drop = PhaseDrop {
            predicted_deg,
            followed_rad_s: (50.0, 200.0),
            drop_deg,
        };
        evaluate(&[left_zero()], Some(&OPPOSITE), phase_drop).1
    };
    for why in [of_phases(-0.0, 350.0), of_phases(350.0, -0.3)] {
        assert!(why.contains(" 0") && !why.contains("-0"), "{why}");
    }
    let near_axis = UncertainZero {
        s: Complex::new(-1e-5, 100.0),
        ..left_zero()
    };
    let uncertain = UncertainZero {
        rhp_probability: 0.5,
        covariance: [[0.01, 0.0], [0.0, 0.0]],
        ..near_axis
    };
    let case = Case::of(&Stage::with_pair(2.0));
    let why_of = |zero| uncertain_side(&[zero], &case.input()).expect("on no side");
    let [certain, uncertain] = [near_axis, uncertain].map(why_of);
    assert!(uncertain.contains("the zero 0.000 ± 0.196"), "{uncertain}");
    assert!(certain.contains("the zero 0.0000 ± 0.0000"), "{certain}");
    // A longer record helps only where the interval is wider than the accuracy of a fit.
    assert!(uncertain.contains("or the duration"), "{uncertain}");
    assert!(
        certain.contains("a longer record does not decide"),
        "{certain}"
    );
}

#[test]
fn longer_record_is_no_remedy_for_a_zero_that_response_and_modes_have_at_other_places() {
    let case = Case::of(&Stage::with_pair(2.0));
    let why_of = |sigma, shift| {
        let shift = Complex::new(shift, 0.0);
        uncertain_side(
            &[cnmp_zero(sigma).moved_to(shift + cnmp_zero(sigma).s)],
            &case.input(),
        )
        .expect("on no side")
    };
    let by_noise = why_of(3.0, 0.1);
    assert!(
        by_noise.contains("or the duration to more than"),
        "{by_noise}"
    );
    let by_model = why_of(0.1, -1.5);
    assert!(by_model.contains("the zero -0.500 ± 2.946"), "{by_model}");
    assert!(
        by_model.contains("disagree about it by 1.500 rad/s"),
        "{by_model}"
    );
    assert!(!by_model.contains("duration"), "{by_model}");
}

/// From 50 rad/s to 100 + d the zero at 1 + 100 j turns the phase by 2 (atan(d) + atan(50)) + 2 (atan(200 + d) - atan(150)): 180 degrees with
/// d = 0.0183.
#[test]
fn phase_confirms_a_pair_that_turns_it_by_half_a_turn_where_it_is_followed() {
    let zeros = [cnmp_zero(1.0 / 3.0)];
    let cnmp_up_to = |to_rad_s| {
        let followed = PhaseDrop {
            followed_rad_s: (50.0, to_rad_s),
            ..phase_drop(180.0, 0.0)
        };
        evaluate(&zeros, Some(&OPPOSITE), followed).0
    };
    assert_eq!(cnmp_up_to(100.02), Cnmp::Detected);
    assert_eq!(cnmp_up_to(100.01), Cnmp::Undecided);
}

/// A real zero and a pair that the phase confirms do not stand for another pair.
#[test]
fn phase_confirms_each_pair_by_itself() {
    let real = UncertainZero {
        s: Complex::new(100.0, 0.0),
        kind: ZeroKind::Rnmp,
        ..cnmp_zero(0.0)
    };
    let beyond = UncertainZero {
        s: Complex::new(1.0, 250.0),
        ..cnmp_zero(0.0)
    };
    let zeros = [real, cnmp_zero(0.0), beyond];
    let (cnmp, why) = evaluate(&zeros, Some(&OPPOSITE), phase_drop(720.0, 0.0));
    assert_eq!(cnmp, Cnmp::Undecided);
    // |1 + 250 j| is 39.79 Hz.
    assert!(
        why.starts_with("the fit has CNMP zeros at 39.79 Hz"),
        "{why}"
    );
    let (cnmp, _) = evaluate(&zeros[..2], Some(&OPPOSITE), phase_drop(720.0, 0.0));
    assert_eq!(cnmp, Cnmp::Detected);
}

/// A lag that is not stated gave complex residues with a zero at 1136 +- 1225j rad/s, of a stage whose zeros all lie left of the axis.
#[test]
fn zeros_of_complex_residues_far_right_need_one_at_their_mirror_image() {
    let at = |re: f64, im: f64, kind: ZeroKind| UncertainZero {
        s: Complex::new(re, im),
        kind,
        ..cnmp_zero(0.0)
    };
    let lag = at(1136.0, 1225.0, ZeroKind::Cnmp);
    // |1136 + 1225 j| is 1671: at most 334 from the mirror image, and from the axis.
    let [near_image, far_image] = [-803.0, -801.0].map(|re| at(re, 1225.0, ZeroKind::Cmp));
    let [near_axis, far_axis] = [0.2, 0.21].map(|re| at(re, 1.0, ZeroKind::Cnmp));
    let real = at(1136.0, 0.0, ZeroKind::Rnmp);
    for (zeros, kept) in [
        (vec![lag], vec![]),
        (vec![lag, near_image], vec![lag, near_image]),
        (vec![lag, far_image], vec![far_image]),
        (vec![near_axis, real], vec![near_axis, real]),
        (vec![far_axis, left_zero()], vec![left_zero()]),
    ] {
        let of_stage = zeros_of_the_stage(&zeros);
        assert_eq!(of_stage, kept, "{zeros:?}");
        let is_pair_left = kept.iter().any(|zero| zero.kind == ZeroKind::Cnmp);
        let why = only_of_the_chain(&zeros, &of_stage);
        assert_eq!(why.is_none(), is_pair_left, "{why:?}");
    }
    let why = only_of_the_chain(&[lag], &[]).expect("a reason");
    assert!(
        why.starts_with("the zero 1136.0 \u{b1} 1225.0j rad/s at 265.89 Hz"),
        "{why}"
    );
    assert_eq!(only_of_the_chain(&[left_zero()], &[]), None);
}

#[test]
fn only_neighbours_of_opposite_signs_are_opposite() {
    let evaluated =
        |signs: &[f64]| evaluate(&[cnmp_zero(0.0)], Some(signs), phase_drop(350.0, 0.0));
    for signs in [vec![1.0, -1.0], vec![-2.0, 3.0], vec![1.0, 2.0, -1e-9]] {
        assert_eq!(evaluated(&signs).0, Cnmp::Detected, "{signs:?}");
    }
    let equal = [vec![1.0, 1.0], vec![-1.0, -2.0, -3.0]];
    // Without a residue a mode has no sign.
    let none = [vec![], vec![1.0], vec![1.0, 0.0], vec![-1.0, 0.0]];
    for signs in equal.into_iter().chain(none) {
        let (cnmp, why) = evaluated(&signs);
        assert_eq!(cnmp, Cnmp::Undecided, "{signs:?}");
        assert_eq!(why, NO_OPPOSITE_NEIGHBOURS);
    }
}

#[test]
fn complex_residues_need_no_opposite_neighbours() {
    let (cnmp, why) = evaluate(&[cnmp_zero(0.0)], None, phase_drop(350.0, 0.0));
    assert_eq!(cnmp, Cnmp::Detected);
    assert!(why.starts_with("1 pair of CNMP zeros, and "), "{why}");
}

#[test]
fn zeros_left_of_the_axis_need_no_opposite_neighbours() {
    let (cnmp, why) = evaluate(&[left_zero()], Some(&[1.0, 1.0]), phase_drop(0.0, 0.0));
    assert_eq!((cnmp, why.as_str()), (Cnmp::Excluded, NO_CNMP));
}

#[test]
fn reason_of_a_detection_states_pairs_signs_and_phase() {
    let why = |pairs: usize, predicted_deg| {
        let zeros = vec![cnmp_zero(0.0); pairs];
        evaluate(
            &zeros,
            Some(&[1.0, -1.0, 1.0]),
            phase_drop(predicted_deg, 4.0),
        )
        .1
    };
    assert_eq!(
        why(1, 350.0),
        "1 pair of CNMP zeros, residues of opposite signs (+-+), and 354 degrees more phase lag than a minimum-phase system of this magnitude"
    );
    assert!(why(1, 180.0).contains("and 184 degrees more phase lag"));
    assert!(why(2, 360.0).contains("and 364 degrees more phase lag"));
}

/// The modes at 100 and 110 rad/s with residues whose signs are uncertain each, and whose sum has a standard deviation.
fn with_sum_sigma(sum_sigma: f64) -> Case {
    let stage = Stage::with_mode_below(3.0);
    let [second, third] = [1, 2].map(Parameter::Residue);
    let variance = stage.residue(1).powi(2) + stage.residue(2).powi(2);
    // The variance of the sum is 2 variance + 2 covariance.
    let covariance = 0.5 * sum_sigma * sum_sigma - variance;
    Case::of(&stage)
        .with_covariance(second, second, variance)
        .with_covariance(third, third, variance)
        .with_covariance(second, third, covariance)
}

#[test]
fn neighbours_of_uncertain_signs_count_by_the_sum_of_their_residues() {
    let stage = Stage::with_mode_below(3.0);
    let sum = stage.residue(1) + stage.residue(2);
    let signs_at = |sigmas: f64| signs_of(&with_sum_sigma(sum.abs() / sigmas).input());
    // The quantile of 1e-3 is 3.0902.
    let certain = signs_at(3.1);
    assert_eq!(certain.len(), 2, "{certain:?}");
    // Rounding of the residues.
    let size = stage.residue(1).abs();
    assert!((certain[0] - stage.residue(0)).abs() < 1e-12 * size);
    assert!((certain[1] - sum).abs() < 1e-12 * size);
    assert_eq!(signs_at(3.08).len(), 1);
}

#[test]
fn modes_of_certain_signs_count_one_by_one() {
    let case = Case::of(&Stage::with_mode_below(3.0));
    let signs = signs_of(&case.input());
    let positive: Vec<bool> = signs.iter().map(|sign| *sign > 0.0).collect();
    assert_eq!(positive, [true, true, false]);
}

#[test]
fn modes_outside_the_band_have_no_sign() {
    let case = Case {
        up_to_rad_s: 109.9,
        ..Case::of(&Stage::with_mode_below(3.0))
    };
    assert_eq!(signs_of(&case.input()).len(), 2);
}

#[test]
fn residue_of_unknown_variance_has_no_sign() {
    let mut case = Case::of(&Stage::with_pair(3.0));
    let size = case.fit.covariance.nrows();
    case.fit.covariance = DMatrix::zeros(size, size);
    let at = index(&case.fit, Parameter::Residue(0));
    case.fit.covariance[(at, at)] = f64::INFINITY;
    assert_eq!(signs_of(&case.input()).len(), 1);
}

#[test]
fn a_real_zero_right_of_the_axis_is_stated() {
    // At 2 pi 7.5 rad/s.
    let zero = UncertainZero {
        s: Complex::new(47.123_889_8, 0.0),
        kind: ZeroKind::Rnmp,
        ..left_zero()
    };
    let (cnmp, why) = evaluate(
        &[left_zero(), zero],
        Some(&[1.0, 1.0]),
        phase_drop(180.0, 0.0),
    );
    assert_eq!(cnmp, Cnmp::Excluded);
    assert!(
        why.starts_with("all complex zeros of the fit lie left"),
        "{why}"
    );
    assert!(
        why.contains("a real zero lies right of it, at 7.5 Hz"),
        "{why}"
    );
}

#[test]
fn the_lowest_certain_real_zero_is_stated_before_an_uncertain_one() {
    let real = |re: f64, sigma: f64, rhp_probability| UncertainZero {
        s: Complex::new(re, 0.0),
        covariance: [[sigma * sigma, 0.0], [0.0, 0.0]],
        kind: ZeroKind::Rnmp,
        rhp_probability,
        difference: Complex::new(0.0, 0.0),
    };
    let why = |zeros: &[UncertainZero]| evaluate(zeros, Some(&[1.0, 1.0]), phase_drop(0.0, 0.0)).1;
    let (certain, higher) = (real(47.123_889_8, 1.0, 1.0), real(100.0, 1.0, 1.0));
    let uncertain = real(10.0, 32.7, 0.62);
    let text = why(&[uncertain, higher, certain]);
    assert!(text.contains("lies right of it, at 7.5 Hz"), "{text}");
    let text = why(&[uncertain]);
    assert!(
        text.contains("a real zero may lie (62 %) right of it, at 1.6 Hz"),
        "{text}"
    );
}
