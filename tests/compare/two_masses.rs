//! Chirps of a stage of two masses with other noise or another spring.

use bench_experiment::run_comparison::{Comparison, Difference};

use crate::compare::compared::{
    GUIDE_N_PER_M, config, differences, mean_square_ratio, modes, of_equal_stages, result,
};

/// Asserts that a difference is that of the closed form, within five standard deviations: a probability of 6e-7.
fn is_difference(what: &str, found: &Difference, expected: f64) {
    let off = (found.difference.value - expected).abs();
    let sigma = found.difference.sigma;
    assert!(off < 5.0 * sigma, "{what}: {found:?}, expected {expected}");
}

#[test]
fn finds_a_softer_spring_with_sign_and_size_of_the_closed_form() {
    let softer_n_per_m = 0.98 * GUIDE_N_PER_M;
    let runs = [
        result(&config(GUIDE_N_PER_M, 1)),
        result(&config(softer_n_per_m, 2)),
    ];
    let comparison = Comparison::of(&runs).expect("two chirps");
    let found = &comparison.others[0];
    assert_eq!(found.modes.modes.len(), 2, "{found:?}");
    let (stiff, soft) = (modes(GUIDE_N_PER_M), modes(softer_n_per_m));
    for ((mode, stiff), soft) in found.modes.modes.iter().zip(stiff).zip(soft) {
        is_difference("frequency", &mode.frequency_hz, soft.0 - stiff.0);
        is_difference("residue", &mode.residue_per_kg, soft.1 - stiff.1);
        is_difference("damping", &mode.damping_ratio, 0.0);
        assert!(!mode.sign_differs);
    }
    // Almost all of the spring is in the first mode: -0.97 % of its frequency, by the closed form.
    let first = &found.modes.modes[0].frequency_hz;
    let percent = first.percent().expect("a frequency");
    assert!(
        first.significant && (-1.05..-0.9).contains(&percent),
        "{first:?}"
    );
    // 1/k1: 2.04 % more.
    let compliance = found.modes.static_compliance_m_per_n.expect("a compliance");
    is_difference(
        "compliance",
        &compliance,
        1.0 / softer_n_per_m - 1.0 / GUIDE_N_PER_M,
    );
    assert!(compliance.significant, "{compliance:?}");
    let keys: Vec<&str> = found.settings.iter().map(|one| one.key.as_str()).collect();
    assert_eq!(keys, ["plant.springs.guide.stiffness_n_per_m", "sim.seed"]);
    let [value, reference] = [softer_n_per_m, GUIDE_N_PER_M].map(|k| Some(format!("{k:?}")));
    let stiffness = &found.settings[0];
    assert_eq!(
        (&stiffness.value, &stiffness.reference),
        (&value, &reference)
    );
    assert_eq!(
        (found.signs_differ, found.verdict_differs),
        (Some(false), Some(false))
    );
}

#[test]
fn equal_stages_seldom_differ_significantly_and_by_their_sigmas() {
    let pairs: Vec<Comparison> = (0..6).map(of_equal_stages).collect();
    let different = pairs.iter().filter(|pair| pair.significant > 0).count();
    // Expected: at most 5 % of 6. Three or more have a probability of 0.2 %.
    assert!(different <= 2, "{different} of 6");
    let found: Vec<Difference> = pairs.iter().flat_map(differences).collect();
    assert_eq!(found.len(), 6 * 7, "two modes and the compliance");
    // A quarter of the differences of a pair is taken as independent. The mean square of 10 independent ratios is between the
    // quantiles 0.1 % and 99.9 % of chi^2_10/10: 0.15 and 2.96.
    let ratio = mean_square_ratio(&found);
    assert!((0.15..2.96).contains(&ratio), "{ratio}");
}
