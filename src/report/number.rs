//! Numbers for people: as many digits as their error leaves them.

/// Digits behind the point with which an error of this size shows two of its own.
pub fn decimals(error: f64) -> usize {
    if !(error.is_finite() && error > 0.0) {
        return 6;
    }
    (1.0 - libm::log10(error).floor()).clamp(0.0, 12.0) as usize
}

/// A number with so many digits and a true minus sign.
pub fn plain(value: f64, digits: usize) -> String {
    format!("{value:.digits$}").replace('-', "\u{2212}")
}

/// A number and half the width of its interval: `29.274373 ± 0.000062`.
pub fn interval(value: f64, half: f64) -> String {
    let digits = decimals(half);
    match half.is_finite() {
        true => format!("{} ± {half:.digits$}", plain(value, digits)),
        false => format!("{} ± without bound", plain(value, digits)),
    }
}

/// A probability in percent; its ends as bounds, as nobody knows a normal distribution's tails better.
pub fn percent(probability: f64) -> String {
    match probability {
        p if p < 1e-4 => "below 0.01 %".into(),
        p if p > 1.0 - 1e-4 => "above 99.99 %".into(),
        p => format!("{:.2} %", 100.0 * p),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_has_two_digits_of_its_error() {
        assert_eq!(interval(29.274_373_12, 0.000_061_6), "29.274373 ± 0.000062");
        assert_eq!(interval(-1234.5, 67.0), "\u{2212}1234 ± 67");
        assert_eq!(interval(-0.5, 0.0), "\u{2212}0.500000 ± 0.000000");
        assert_eq!(interval(0.5, f64::INFINITY), "0.500000 ± without bound");
        assert_eq!(
            [1e-9, 0.5, 0.99999].map(percent),
            ["below 0.01 %", "50.00 %", "above 99.99 %"]
        );
    }
}
