//! The difference of two estimates and its significance.

use serde::Serialize;

use super::mode_pairs::probability_of_difference;
use bench_identify::Estimate;

/// Probability that noise alone makes any of the tested differences significant.
pub const FAMILY_FALSE_ALARM: f64 = 0.05;

/// A value of the reference run and of another run, from independent records.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// In the reference run.
    pub reference: Estimate,
    /// In the other run.
    pub other: Estimate,
    /// The other minus the reference, with sigma^2 = sigma_1^2 + sigma_2^2.
    pub difference: Estimate,
    /// Probability that equal values differ at least this much.
    pub probability: f64,
    /// Whether it is significant by the test of Holm over all differences of the comparison.
    pub significant: bool,
}

impl Difference {
    /// The difference of two estimates, not yet significant.
    pub fn of(reference: Estimate, other: Estimate) -> Difference {
        Difference {
            reference,
            other,
            difference: Estimate {
                value: other.value - reference.value,
                sigma: libm::hypot(reference.sigma, other.sigma),
            },
            probability: probability_of_difference(reference, other),
            significant: false,
        }
    }

    /// The difference in percent of the reference; `None` if the reference is 0.
    pub fn percent(&self) -> Option<f64> {
        let reference = self.reference.value;
        (reference != 0.0).then(|| 100.0 * self.difference.value / reference.abs())
    }
}

/// Marks the significant ones of `differences` by the step-down test of Holm [Scandinavian Journal of Statistics 6 (1979), 65-70]:
/// of m probabilities in rising order, the first k are significant as long as p_k < 5 %/(m - k + 1). If all values are equal,
/// the probability of any significant difference is at most 5 %, also for dependent differences.
pub(super) fn mark_significant(mut differences: Vec<&mut Difference>) {
    differences.sort_by(|a, b| a.probability.total_cmp(&b.probability));
    let count = differences.len();
    for (k, difference) in differences.into_iter().enumerate() {
        if difference.probability >= FAMILY_FALSE_ALARM / (count - k) as f64 {
            return;
        }
        difference.significant = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_probability(probability: f64) -> Difference {
        let zero = Estimate {
            value: 0.0,
            sigma: 1.0,
        };
        Difference {
            probability,
            ..Difference::of(zero, zero)
        }
    }

    fn marked(probabilities: &[f64]) -> Vec<bool> {
        let mut all: Vec<Difference> = probabilities
            .iter()
            .copied()
            .map(with_probability)
            .collect();
        mark_significant(all.iter_mut().collect());
        all.iter().map(|one| one.significant).collect()
    }

    #[test]
    fn marks_by_the_step_down_test_of_holm() {
        // Limits of four differences: 0.0125, 0.01667, 0.025, 0.05. Bonferroni alone would stop after the first.
        assert_eq!(
            marked(&[0.024, 0.012, 0.06, 0.016]),
            [true, true, false, true]
        );
        // The second smallest is not significant, so that no larger one is.
        assert_eq!(
            marked(&[0.012, 0.017, 0.018, 0.019]),
            [true, false, false, false]
        );
        assert_eq!(marked(&[0.049]), [true]);
        assert_eq!(marked(&[0.051]), [false]);
        assert!(marked(&[]).is_empty());
    }

    #[test]
    fn difference_has_the_errors_of_both_runs() {
        let estimate = |value, sigma| Estimate { value, sigma };
        let found = Difference::of(estimate(10.0, 0.3), estimate(9.0, 0.4));
        assert!((found.difference.value + 1.0).abs() < 1e-12);
        assert!((found.difference.sigma - 0.5).abs() < 1e-12);
        // Two-sided probability of two standard deviations (scipy.special.erfc(2/sqrt(2))).
        assert!((found.probability - 0.045_500_263_896_358).abs() < 1e-12);
        assert_eq!(found.percent(), Some(-10.0));
    }
}
