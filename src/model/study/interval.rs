//! How well a probability is known.

/// Standard deviations of a normal distribution between which 95 % lie.
const Z: f64 = 1.959_963_984_540_054;

/// The 95 % interval of a probability that `yes` of `all` draws were of, by Wilson (J. Am. Stat. Assoc. 22, 209, 1927):
///
/// ```text
///  (p + z^2/2n -+ z sqrt(p (1 - p)/n + z^2/4n^2))/(1 + z^2/n),  p = yes/n
/// ```
///
/// It holds for none and for all as well, where the normal approximation has no width. 0 to 1 for no draws.
pub(super) fn wilson(yes: u64, all: u64) -> [f64; 2] {
    if all == 0 {
        return [0.0, 1.0];
    }
    let (n, p) = (all as f64, yes as f64 / all as f64);
    let (centre, scale) = (p + Z * Z / (2.0 * n), 1.0 + Z * Z / n);
    let half = Z * (p * (1.0 - p) / n + Z * Z / (4.0 * n * n)).sqrt();
    // At its ends the interval is exactly 0 or 1, which rounding would miss.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ends_solve_the_score_equation() {
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
            let [low, high] = wilson(yes, all);
            assert!(low < p && p < high);
            for w in [low, high] {
                let (left, right) = ((p - w) * (p - w), Z * Z * w * (1.0 - w) / all as f64);
                assert!((left / right - 1.0).abs() < 1e-9, "{yes} of {all}: {w}");
            }
        }
    }

    #[test]
    fn none_and_all_have_a_width() {
        // (1 - 0) = z^2 w/n with w at the other end: w = z^2/(n + z^2).
        let width = Z * Z / (100.0 + Z * Z);
        let ([a, b], [c, d]) = (wilson(0, 100), wilson(100, 100));
        assert_eq!((a, d), (0.0, 1.0));
        assert!((b - width).abs() < 1e-15 && (1.0 - c - width).abs() < 1e-15);
        assert_eq!(wilson(0, 0), [0.0, 1.0]);
    }
}
