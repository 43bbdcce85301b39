//! False alarms of the comparison of equal stages.

use bench_test_support::compared::of_equal_stages;

const PAIRS: u64 = 40;

#[test]
fn noise_makes_comparisons_significant_in_at_most_5_percent() {
    let comparisons: Vec<_> = (0..PAIRS).map(of_equal_stages).collect();
    let different = comparisons.iter().filter(|one| one.significant > 0).count();
    // Expected: at most 2. Seven or more have a probability of 0.3 %.
    assert!(different <= 6, "{different} of {PAIRS}");
    // Each difference by itself exceeds its 95 % interval in 5 % of the cases: with sigmas that are too large, in fewer.
    let mut outside = 0;
    let mut tested = 0;
    for comparison in &comparisons {
        let modes = &comparison.others[0].modes;
        let of_modes = modes
            .modes
            .iter()
            .flat_map(|mode| [mode.frequency_hz, mode.damping_ratio, mode.residue_per_kg]);
        for found in of_modes.chain(modes.static_compliance_m_per_n) {
            tested += 1;
            outside += u32::from(found.probability < 0.05);
        }
    }
    assert_eq!(
        tested,
        7 * PAIRS,
        "two modes and the compliance in each pair"
    );
    // 14 are expected of 280. The differences of a pair are correlated: with a quarter of them independent, sigma is 7.
    println!("{different} of {PAIRS} pairs, {outside} of {tested} differences");
    assert!((3..=35).contains(&outside), "{outside} of {tested}");
}
