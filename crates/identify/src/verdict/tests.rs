//! Every reason of a verdict, and both sides of every limit, by fits made by hand.

mod criteria;
mod phase;
mod quantities;
mod stage;
mod zeros;

use nalgebra::Complex;

use super::{Certainty, Cnmp, Verdict};
use crate::modal::{OneMoreMode, Parameter};
use bench_plant::zeros::{ModalTerm, ZeroKind};
use stage::{Case, DAMPING_RAD_S, PAIR_RAD_S, Stage, UP_TO_RAD_S, all_pass_lag_deg, hertz, pair};

/// Errors of the Bode integral over data 1 rad/s apart, in degrees: between the data around a zero near the axis, the area under
/// ln|G| is too large by up to 1 rad/s, 0.01 in ln w; at the nearest end of the band, ln(120.5/105) = 0.14 away, that turns the
/// phase by 0.01/(pi sinh 0.14) = 1.3 degrees. Six such errors.
const BODE_ERROR_DEG: f64 = 8.0;

fn assert_undecided(verdict: &Verdict, reason: &str) {
    assert!(
        verdict.cnmp == Cnmp::Undecided && verdict.why.contains(reason),
        "{verdict:?}"
    );
}

#[test]
fn detects_a_pair_of_cnmp_zeros() {
    let zero = pair(3.0);
    let verdict = Case::of(&Stage::with_pair(zero.re)).verdict();
    assert_eq!(verdict.cnmp, Cnmp::Detected, "{}", verdict.why);
    assert!(
        verdict
            .why
            .starts_with("1 pair of CNMP zeros, residues of opposite signs (+-), and "),
        "{}",
        verdict.why
    );
    let right: Vec<_> = verdict.zeros.iter().filter(|z| z.s.re > 0.0).collect();
    // The eigenvalues of a pencil of this size are exact to some hundred roundings.
    assert!(right.len() == 1 && (right[0].s - zero).norm() < 1e-10);
    assert_eq!(right[0].kind, ZeroKind::Cnmp);
}

#[test]
fn excludes_cnmp_zeros_if_all_zeros_are_certainly_left_of_the_axis() {
    let verdict = Case::of(&Stage::with_pair(-0.3)).verdict();
    assert_eq!(verdict.cnmp, Cnmp::Excluded, "{}", verdict.why);
    assert_eq!(verdict.why, super::NO_CNMP);
    // -0.3 + 105 j and its companion -(2 - 0.3) + 105 j.
    let mut re: Vec<f64> = verdict.zeros.iter().map(|zero| zero.s.re).collect();
    re.sort_by(f64::total_cmp);
    assert!(re.len() == 2 && (re[0] + 1.7).abs() < 1e-9 && (re[1] + 0.3).abs() < 1e-9);
}

#[test]
fn requires_a_reduced_chi_square_of_at_most_four() {
    let stage = Stage::with_pair(3.0);
    let verdict_at = |chi2_per_freedom: f64| {
        let mut case = Case::of(&stage);
        case.fit.chi2_per_freedom = chi2_per_freedom;
        case.verdict()
    };
    for good in [0.0, 1.0, 4.0] {
        assert_eq!(verdict_at(good).cnmp, Cnmp::Detected, "{good}");
    }
    for poor in [4.01, 12.0, f64::INFINITY, f64::NAN] {
        assert_undecided(&verdict_at(poor), "reduced chi-square");
    }
}

#[test]
fn undecided_if_one_more_mode_that_is_not_excluded_changes_the_number_of_cnmp_pairs() {
    let verdict_with = |certainty: Certainty, more: &Stage, probability: f64| {
        let mut case = Case::of(&Stage::with_mode_below(3.0));
        case.certainty = certainty;
        case.fit.one_more_mode = Some(OneMoreMode {
            parameters: more.fit().parameters,
            near_rad_s: 60.0,
            probability,
            significant_decrease: 30.0,
        });
        case.verdict()
    };
    let (one_look, looks) = (Certainty::ONE_LOOK, Certainty::REPEATED_LOOKS);
    let (other, same) = (Stage::with_mode_below(-0.3), Stage::with_pair(2.0));
    for (certainty, probability) in [(one_look, 1.01e-3), (one_look, 0.5), (looks, 1.3e-4)] {
        let verdict = verdict_with(certainty, &other, probability);
        assert_undecided(&verdict, "one more mode near 9.55 Hz");
        let verdict = verdict_with(certainty, &same, probability);
        assert_eq!(verdict.cnmp, Cnmp::Detected, "{}", verdict.why);
    }
    for (certainty, probability) in [(one_look, 0.99e-3), (looks, 1.2e-4)] {
        let verdict = verdict_with(certainty, &other, probability);
        assert_eq!(verdict.cnmp, Cnmp::Detected, "{}", verdict.why);
    }
}

#[test]
fn requires_every_mode_that_the_model_has() {
    for (stage, found) in [(Stage::with_pair(3.0), 2), (Stage::with_mode_below(3.0), 3)] {
        let verdict_for = |expected_modes: Option<usize>| {
            Case {
                expected_modes,
                ..Case::of(&stage)
            }
            .verdict()
        };
        for expected in [None, Some(found - 1), Some(found)] {
            assert_eq!(verdict_for(expected).cnmp, Cnmp::Detected, "{expected:?}");
        }
        let reason = format!("only {found} of the {} modes", found + 1);
        assert_undecided(&verdict_for(Some(found + 1)), &reason);
    }
}

#[test]
fn counts_only_modes_within_the_band_of_the_verdict() {
    let stage = Stage::with_mode_below(3.0);
    let found = |first_rad_s: f64, up_to_rad_s: f64| {
        let mut case = Case {
            expected_modes: Some(10),
            up_to_rad_s,
            ..Case::of(&stage)
        };
        case.frf_data
            .retain(|datum| datum.omega_rad_s() > first_rad_s);
        // The fit's own frequency as the lower limit.
        case.frf_data[0].frequency_hz = hertz(first_rad_s);
        case.verdict().why
    };
    for (first_rad_s, up_to_rad_s, count) in [
        (59.9, 110.1, 3),
        (60.1, 110.1, 2),
        (59.9, 109.9, 2),
        (60.1, 109.9, 1),
    ] {
        let why = found(first_rad_s, up_to_rad_s);
        assert!(why.contains(&format!("only {count} of the 10")), "{why}");
    }
}

#[test]
fn remedy_for_missing_modes_is_a_longer_band_only_if_the_excitation_ends_below_the_limit() {
    let why = |last_rad_s: f64| {
        let mut case = Case::of(&Stage::with_pair(3.0));
        case.expected_modes = Some(3);
        case.fit.band_hz.1 = hertz(last_rad_s);
        case.verdict().why
    };
    // 230 rad/s are 36.6 Hz.
    let below = why(UP_TO_RAD_S - 0.1);
    assert!(
        below.ends_with("the excitation ends at 37 Hz: extend it to more than 37 Hz"),
        "{below}"
    );
    for not_below in [why(UP_TO_RAD_S), why(UP_TO_RAD_S + 0.1)] {
        assert!(
            not_below.ends_with("increase the amplitude there, or the duration"),
            "{not_below}"
        );
    }
}

#[test]
fn rejects_a_response_without_a_phase() {
    let verdict_with = |response: Complex<f64>| {
        let mut case = Case::of(&Stage::with_pair(3.0));
        case.frf_data[60].response = response;
        case.verdict()
    };
    // 80.5 rad/s are 12.81 Hz.
    for response in [0.0, 1e-310, f64::NAN, f64::INFINITY] {
        let verdict = verdict_with(Complex::new(response, 0.0));
        assert_undecided(&verdict, "the response at 12.81 Hz is ");
    }
}

#[test]
fn zero_is_on_a_side_from_the_quantile_of_the_certainty() {
    // One-sided quantiles of the normal distribution: 3.0902 for 1e-3, 3.6623 for 1e-3/8.
    for (certainty, quantile) in [
        (Certainty::ONE_LOOK, 3.0902),
        (Certainty::REPEATED_LOOKS, 3.6623),
    ] {
        for (re, decided) in [(0.3, Cnmp::Detected), (-0.3, Cnmp::Excluded)] {
            let stage = Stage::with_pair(re);
            let verdict_at = |sigmas: f64| {
                let case = Case::of(&stage).with_zero_at_sigmas(&stage, pair(re), sigmas);
                Case { certainty, ..case }.verdict()
            };
            assert_eq!(verdict_at(quantile + 0.005).cnmp, decided, "{re}");
            assert_undecided(&verdict_at(quantile - 0.005), "either side of");
        }
    }
}

#[test]
fn reason_of_an_uncertain_side_states_the_interval_of_the_zero() {
    let stage = Stage::with_pair(0.3);
    let case = Case::of(&stage).with_zero_at_sigmas(&stage, pair(0.3), 1.5);
    // sigma = 0.2: 1.96 x 0.2 = 0.392. The normal distribution has 93.3 % above -1.5; |0.3 + 105 j| is 16.71 Hz.
    assert_undecided(
        &case.verdict(),
        "the zero 0.300 ± 0.392 at 16.71 Hz may lie on either side of the imaginary axis (right: 93.3 %)",
    );
}

#[test]
fn zero_closer_to_the_axis_than_the_accuracy_of_a_fit_is_on_neither_side() {
    let limit = 1e-4 * PAIR_RAD_S;
    for (sign, decided) in [(1.0, Cnmp::Detected), (-1.0, Cnmp::Excluded)] {
        let verdict_at = |re: f64| Case::of(&Stage::with_pair(sign * re)).verdict();
        assert_eq!(verdict_at(1.01 * limit).cnmp, decided);
        assert_undecided(&verdict_at(0.99 * limit), "within the accuracy of a fit");
    }
}

#[test]
fn real_zero_may_lie_on_either_side() {
    let stage = Stage::with_real_zero(49.0);
    let zero = Complex::new(49.0, 0.0);
    let case = Case::of(&stage).with_zero_at_sigmas(&stage, zero, 0.5);
    let verdict = case.verdict();
    let right = verdict.zeros.iter().find(|zero| zero.s.re > 0.0);
    let right = right.expect("a zero in the right half plane");
    // The normal distribution has 69.15 % above -0.5.
    assert!((right.rhp_probability - 0.6915).abs() < 1e-4, "{right:?}");
    assert_eq!(right.kind, ZeroKind::Rnmp);
    assert_eq!(verdict.cnmp, Cnmp::Excluded, "{}", verdict.why);
}

#[test]
fn covariance_that_is_not_finite_leaves_the_verdict_undecided() {
    for sigma in [f64::NAN, f64::INFINITY] {
        let case = Case::of(&Stage::with_pair(3.0)).with_sigma(Parameter::Remainder, sigma);
        assert_undecided(&case.verdict(), "either side of");
    }
}

#[test]
fn residue_of_uncertain_sign_prevents_a_verdict_if_the_number_of_cnmp_pairs_depends_on_it() {
    // With a residue of the opposite sign both residues and R are positive: then there are no CNMP zeros.
    let stage = Stage::with_pair(3.0);
    let size = stage.residue(1).abs();
    for (certainty, quantile) in [
        (Certainty::ONE_LOOK, 3.0902),
        (Certainty::REPEATED_LOOKS, 3.6623),
    ] {
        let why_at = |sigmas: f64| {
            let case = Case::of(&stage).with_sigma(Parameter::Residue(1), size / sigmas);
            Case { certainty, ..case }.verdict()
        };
        // 110 rad/s are 17.51 Hz.
        let reason = "the sign of the residue at 17.51 Hz is uncertain";
        assert_undecided(&why_at(quantile - 0.02), reason);
        assert!(!why_at(quantile + 0.02).why.contains("sign of the residue"));
    }
}

#[test]
fn residue_of_uncertain_sign_without_effect_on_the_number_of_cnmp_pairs_is_ignored() {
    let weak = ModalTerm {
        omega_rad_s: 160.0,
        damping_ratio: 0.5 * DAMPING_RAD_S / 160.0,
        residue_per_kg: 1e-6 * Stage::with_pair(3.0).residue(0),
    };
    for (re, decided) in [(3.0, Cnmp::Detected), (-0.3, Cnmp::Excluded)] {
        let mut case = Case::of(&Stage::with_pair(re));
        case.fit.parameters.modes.push(weak);
        let free = case.fit.parameters.free().len();
        case.fit.covariance = nalgebra::DMatrix::zeros(free, free);
        let verdict = case
            .with_sigma(Parameter::Residue(2), weak.residue_per_kg)
            .verdict();
        assert_eq!(verdict.cnmp, decided, "{}", verdict.why);
    }
}

#[test]
fn requires_two_modes_for_the_phase() {
    let case = Case {
        up_to_rad_s: 109.9,
        ..Case::of(&Stage::with_pair(3.0))
    };
    let verdict = case.verdict();
    assert_undecided(&verdict, super::TOO_FEW_MODES);
    assert_eq!(verdict.phase_drop, None);
}

#[test]
fn data_that_are_all_noise_have_no_phase() {
    let verdict = Case::of(&Stage::with_pair(3.0))
        .with_noise_above(0.0)
        .verdict();
    assert_eq!(
        (verdict.cnmp, verdict.phase_drop),
        (Cnmp::Undecided, None),
        "{}",
        verdict.why
    );
}

#[test]
fn covers_zeros_from_the_first_datum_to_the_upper_limit() {
    let zeros_of = |case: &Case| case.verdict().zeros.len();
    // The companion -1.7 + 105 j has another magnitude, larger by 1.4/105.
    let size = pair(-0.3).norm();
    let covered_up_to = |up_to_rad_s: f64| Case {
        up_to_rad_s,
        ..Case::of(&Stage::with_pair(-0.3))
    };
    assert_eq!(zeros_of(&covered_up_to(size * (1.0 + 1e-6))), 1);
    assert_eq!(zeros_of(&covered_up_to(size * (1.0 - 1e-6))), 0);
    let covered_from = |first_rad_s: f64| {
        let mut case = Case::of(&Stage::with_pair(-0.3));
        case.frf_data
            .retain(|datum| datum.omega_rad_s() > first_rad_s);
        case.frf_data[0].frequency_hz = hertz(first_rad_s);
        case
    };
    assert_eq!(zeros_of(&covered_from(size * (1.0 - 1e-6))), 2);
    assert_eq!(zeros_of(&covered_from(size * (1.0 + 1e-6))), 1);
}

#[test]
fn predicted_phase_drop_covers_half_the_first_to_a_tenth_above_the_last_mode() {
    let zero = pair(3.0);
    let phase_drop_up_to = |up_to_rad_s: f64| {
        let case = Case {
            up_to_rad_s,
            ..Case::of(&Stage::with_pair(zero.re))
        };
        case.verdict().phase_drop.expect("two modes")
    };
    // From 50 to 121 rad/s, or to the upper limit of the verdict: the data within are those from 50.5 to 120.5 or 115.5 rad/s.
    for (up_to_rad_s, last_rad_s) in [(UP_TO_RAD_S, 120.5), (115.9, 115.5)] {
        let found = phase_drop_up_to(up_to_rad_s);
        let closed_form = all_pass_lag_deg(zero, 50.5, last_rad_s);
        // Rounding, of the zero as well.
        assert!(
            (found.predicted_deg - closed_form).abs() < 1e-7,
            "{found:?}"
        );
        assert!(found.deviation_deg() < BODE_ERROR_DEG, "{found:?}");
    }
}

#[test]
fn data_are_significant_from_twenty_times_the_power_of_their_noise() {
    let zero = pair(3.0);
    let predicted_with = |power_ratio: f64| {
        let mut case = Case::of(&Stage::with_pair(zero.re)).with_noise_above(104.0);
        let datum = case
            .frf_data
            .iter_mut()
            .find(|datum| datum.omega_rad_s() > 112.0)
            .expect("a datum above the modes");
        datum.variance = datum.response.norm_sqr() / power_ratio;
        case.verdict().phase_drop.expect("two modes").predicted_deg
    };
    // The last significant datum is that at 112.5 rad/s, or that at 103.5 rad/s.
    for (power_ratio, last_rad_s) in [(20.2, 112.5), (19.8, 103.5)] {
        let closed_form = all_pass_lag_deg(zero, 50.5, last_rad_s);
        let predicted = predicted_with(power_ratio);
        assert!((predicted - closed_form).abs() < 1e-7, "{predicted}");
    }
}

#[test]
fn undecided_if_the_measured_phase_disagrees_with_the_zeros() {
    // Data of the same magnitude with the zeros on the other side of the axis.
    let zero = pair(3.0);
    let predicted = all_pass_lag_deg(zero, 50.5, 120.5);
    let case = Case::of(&Stage::with_pair(zero.re)).with_mirrored_data(zero);
    let verdict = case.verdict();
    let reason = format!(
        "the zeros of the fit predict {predicted:.0} degrees more phase lag than a minimum"
    );
    assert_undecided(&verdict, &reason);
    let drop_deg = verdict.phase_drop.expect("two modes").drop_deg;
    assert!(drop_deg.abs() < BODE_ERROR_DEG, "{drop_deg}");

    // The phase of the data over that of the fit turns by 4 atan(0.5/0.9) = 116 degrees from one frequency to the next.
    let zero = pair(-0.9);
    let case = Case::of(&Stage::with_pair(zero.re)).with_mirrored_data(zero);
    let verdict = case.verdict();
    assert_undecided(&verdict, "the zeros of the fit predict ");
    let lag = all_pass_lag_deg(-zero.conj(), 50.5, 120.5);
    let drop_deg = verdict.phase_drop.expect("two modes").drop_deg;
    assert!((drop_deg - lag).abs() < BODE_ERROR_DEG, "{drop_deg}");
}

#[test]
fn cnmp_zeros_in_noise_give_no_verdict_at_any_distance_from_the_axis() {
    let (stage, zero) = (Stage::with_pair(3.0), pair(3.0));
    // The phase is followed to 103.5 rad/s only: less than half of the turn.
    assert!(all_pass_lag_deg(zero, 50.5, 103.5) < 150.0);
    for sigmas in [5.0, 60.0] {
        let case = || Case::of(&stage).with_zero_at_sigmas(&stage, zero, sigmas);
        // |3 + 105 j| is 16.72 Hz.
        assert_undecided(
            &case().with_noise_above(104.0).verdict(),
            "the fit has CNMP zeros at 16.72 Hz, where the response is noise",
        );
        // With the phase around them the same zeros are certain.
        let confirmed = case().verdict();
        assert_eq!(confirmed.cnmp, Cnmp::Detected, "{}", confirmed.why);
    }
}

#[test]
fn cnmp_zeros_require_neighbouring_modes_of_opposite_signs() {
    // Without the mode at 110 rad/s the modes of the band have the signs + +, and its zeros remain.
    let verdict_up_to = |up_to_rad_s: f64| {
        let case = Case {
            up_to_rad_s,
            ..Case::of(&Stage::with_mode_below(3.0))
        };
        case.verdict()
    };
    assert_undecided(&verdict_up_to(107.0), super::NO_OPPOSITE_NEIGHBOURS);
    let all = verdict_up_to(UP_TO_RAD_S);
    assert_eq!(all.cnmp, Cnmp::Detected, "{}", all.why);
    assert!(all.why.contains("opposite signs (++-)"), "{}", all.why);
}

#[test]
fn caution_is_added_to_the_reason() {
    let verdict = Verdict::undecided("no modes".into());
    assert_eq!(verdict.cnmp.name(), "undecided");
    assert_eq!(verdict.clone().with(None), verdict);
    assert_eq!(
        verdict.with(Some("clipped".into())).why,
        "no modes; clipped"
    );
}
