//! Numerical helpers: comparison with a limit, rounding for texts, evenly spaced values, roots by bisection, assignment by distance, confidence of a proportion.

/// Whether a value is at most a limit. A value that is not a number is beyond every limit, whereas `value > limit` would
/// accept it.
pub fn is_within(value: f64, limit: f64) -> bool {
    value <= limit
}

/// The larger one of two values; not a number if one of them is not a number, whereas [`f64::max`] would drop it.
pub fn larger(a: f64, b: f64) -> f64 {
    if a >= b || a.is_nan() { a } else { b }
}

/// A value to four decimals: without the rounding of its computation, for texts.
pub fn to_four_decimals(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

/// `count` evenly spaced values, two or more, both ends among them exactly.
pub fn linspace(from: f64, to: f64, count: usize) -> impl Iterator<Item = f64> {
    let last = count - 1;
    (0..count).map(move |k| {
        if k == last {
            to
        } else {
            from + (to - from) * k as f64 / last as f64
        }
    })
}

/// The place where `function` changes its sign between `low` and `high`, where it has different signs; to the last bits.
pub fn bisect(function: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    let negative = function(low) < 0.0;
    for _ in 0..64 {
        let middle = 0.5 * (low + high);
        if (function(middle) < 0.0) == negative {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Assigns each of `rows` to a different one of `columns`, the pairs of lowest cost first. `None` for a row that is left
/// without a partner.
pub fn assign(
    rows: usize,
    columns: usize,
    cost: impl Fn(usize, usize) -> f64,
) -> Vec<Option<usize>> {
    let pairs = (0..rows).flat_map(|i| (0..columns).map(move |j| (i, j)));
    let mut pairs: Vec<(f64, usize, usize)> = pairs.map(|(i, j)| (cost(i, j), i, j)).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (mut partners, mut is_taken) = (vec![None; rows], vec![false; columns]);
    for (_, i, j) in pairs {
        if partners[i].is_none() && !is_taken[j] {
            partners[i] = Some(j);
            is_taken[j] = true;
        }
    }
    partners
}

/// Standard deviations of a normal distribution between which 95 % of it lie.
const Z_95: f64 = 1.959_963_984_540_054;

/// The 95 % confidence interval of a probability of which `yes` out of `all` draws were found, by Wilson (J. Am. Stat.
/// Assoc. 22, 209, 1927):
///
/// ```text
///  (p + z^2/2n -+ z sqrt(p (1 - p)/n + z^2/4n^2))/(1 + z^2/n),  p = yes/n
/// ```
///
/// The width is above zero also for `yes` = 0 and `yes` = `all`, unlike that of the normal approximation. [0, 1] if
/// `all` is 0.
pub fn wilson_interval(yes: u64, all: u64) -> [f64; 2] {
    if all == 0 {
        return [0.0, 1.0];
    }
    let (n, p) = (all as f64, yes as f64 / all as f64);
    let (centre, scale) = (p + Z_95 * Z_95 / (2.0 * n), 1.0 + Z_95 * Z_95 / n);
    let half = Z_95 * (p * (1.0 - p) / n + Z_95 * Z_95 / (4.0 * n * n)).sqrt();
    // At its ends the interval is exactly 0 or 1; rounding would miss them.
    let low = if yes == 0 {
        0.0
    } else {
        (centre - half) / scale
    };
    let high = if yes == all {
        1.0
    } else {
        (centre + half) / scale
    };
    [low, high]
}

/// The 95 % confidence interval of a variance over its estimate with n degrees of freedom: n over the quantiles of chi-square at
/// 97.5 % and 2.5 %, by E. B. Wilson and M. M. Hilferty (Proc. Natl. Acad. Sci. 17, 684, 1931):
///
/// ```text
///  chi^2 = n (1 - 2/9n +- z sqrt(2/9n))^3
/// ```
///
/// Within 2 % of the exact limits for 7 degrees of freedom and more.
pub fn variance_interval(freedoms: f64) -> [f64; 2] {
    let spread = 2.0 / (9.0 * freedoms);
    let limit = |z: f64| {
        let root = 1.0 - spread + z * spread.sqrt();
        1.0 / (root * root * root).max(0.0)
    };
    [limit(Z_95), limit(-Z_95)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_is_not_a_number_is_beyond_every_limit() {
        assert!(is_within(-1.0, 2.0) && is_within(2.0, 2.0) && !is_within(2.1, 2.0));
        assert!(!is_within(f64::NAN, f64::INFINITY) && !is_within(1.0, f64::NAN));
        assert_eq!((larger(1.0, 2.0), larger(2.0, 1.0)), (2.0, 2.0));
        assert!(larger(1.0, f64::NAN).is_nan() && larger(f64::NAN, 1.0).is_nan());
    }

    #[test]
    fn linspace_has_both_ends_exactly() {
        let values: Vec<f64> = linspace(-0.1, 0.3, 7).collect();
        assert_eq!((values.len(), values[0], values[6]), (7, -0.1, 0.3));
        assert!(values.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn bisect_finds_a_root_to_rounding() {
        let root = bisect(|x| x * x - 2.0, 0.0, 2.0);
        assert!((root - 2f64.sqrt()).abs() <= f64::EPSILON * 2.0);
        let falling = bisect(|x| 2.0 - x * x, 0.0, 2.0);
        assert!((falling - root).abs() <= f64::EPSILON * 2.0);
    }

    #[test]
    fn assign_takes_the_closest_pairs_first() {
        let (rows, columns) = ([0.0, 10.0, 20.0], [9.0, 1.0]);
        let found = assign(3, 2, |i, j| f64::abs(rows[i] - columns[j]));
        assert_eq!(found, [Some(1), Some(0), None]);
    }

    #[test]
    fn wilson_interval_solves_the_score_equation() {
        // Both ends w satisfy (p - w)^2 = z^2 w (1 - w)/n.
        for (yes, all) in [
            (1, 10),
            (5, 10),
            (9, 10),
            (388, 1000),
            (12_040, 20_000),
            (1, 1_000_000),
        ] {
            let p = yes as f64 / all as f64;
            let [low, high] = wilson_interval(yes, all);
            assert!(low < p && p < high);
            for w in [low, high] {
                let (left, right) = ((p - w) * (p - w), Z_95 * Z_95 * w * (1.0 - w) / all as f64);
                assert!((left / right - 1.0).abs() < 1e-9, "{yes} of {all}: {w}");
            }
        }
    }

    #[test]
    fn wilson_interval_of_none_and_of_all_has_a_width() {
        // (1 - 0) = z^2 w/n with w at the other end: w = z^2/(n + z^2).
        let width = Z_95 * Z_95 / (100.0 + Z_95 * Z_95);
        let ([a, b], [c, d]) = (wilson_interval(0, 100), wilson_interval(100, 100));
        assert_eq!((a, d), (0.0, 1.0));
        assert!((b - width).abs() < 1e-15 && (1.0 - c - width).abs() < 1e-15);
        assert_eq!(wilson_interval(0, 0), [0.0, 1.0]);
    }

    #[test]
    fn variance_interval_is_that_of_chi_square() {
        // Tables of chi-square at 97.5 % and 2.5 %.
        for (freedoms, upper, lower) in [
            (7.0, 16.0128, 1.68987),
            (14.0, 26.1189, 5.62873),
            (100.0, 129.561, 74.2219),
        ] {
            let [low, high] = variance_interval(freedoms);
            for (found, quantile) in [(low, upper), (high, lower)] {
                let exact: f64 = freedoms / quantile;
                assert!(
                    (found / exact - 1.0).abs() < 0.02,
                    "{freedoms}: {found} for {exact}"
                );
            }
        }
    }
}
