//! False alarms of the comparison of equal stages.

use bench_test_support::compared::{differences, mean_square_ratio, of_equal_stages};

const PAIRS: u64 = 40;

#[test]
fn noise_makes_comparisons_significant_in_at_most_5_percent() {
    let comparisons: Vec<_> = (0..PAIRS).map(of_equal_stages).collect();
    let different = comparisons.iter().filter(|one| one.significant > 0).count();
    // Expected: at most 2. Seven or more have a probability of 0.3 %.
    assert!(different <= 6, "{different} of {PAIRS}");
    // Each difference by itself exceeds its 95 % interval in 5 % of the cases: with sigmas that are too large, in fewer.
    let tested: Vec<_> = comparisons.iter().flat_map(differences).collect();
    assert_eq!(
        tested.len() as u64,
        7 * PAIRS,
        "two modes and the compliance in each pair"
    );
    let outside = tested.iter().filter(|found| found.probability < 0.05);
    let outside = outside.count();
    let ratio = mean_square_ratio(&tested);
    println!(
        "{different} of {PAIRS} pairs, {outside} of {} differences, mean square {ratio}",
        tested.len()
    );
    // 14 are expected of 280. The differences of a pair are correlated: with a quarter of them independent, sigma is 7.
    assert!((3..=35).contains(&outside), "{outside}");
    // The mean square of 70 independent ratios is between the quantiles 0.1 % and 99.9 % of chi^2_70/70: 0.56 and 1.60.
    assert!((0.56..1.60).contains(&ratio), "{ratio}");
}
