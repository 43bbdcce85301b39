//! Numbers in text, with as many digits as their error allows.

use std::f64::consts::TAU;

use bench_base::decimal::Decimal;

/// Decimals that show two digits of an error.
pub fn decimals(error: f64) -> usize {
    if !(error.is_finite() && error > 0.0) {
        return 6;
    }
    (1.0 - libm::log10(error).floor()).clamp(0.0, 12.0) as usize
}

/// A number with a typographic minus sign.
pub fn plain(value: f64, digits: usize) -> String {
    format!("{:.digits$}", Decimal(value)).replace('-', "\u{2212}")
}

/// A number that is not negative, with this many significant digits: `0.0341`, `34.1` and `1640` with three.
pub fn significant(value: f64, digits: usize) -> String {
    // The exponent of the rounded number: 9.999 becomes 10.0 and not 10.00.
    let scientific = format!("{value:.*e}", digits.saturating_sub(1));
    let exponent = scientific
        .split_once('e')
        .map_or("0", |(_, exponent)| exponent);
    let before_point = exponent.parse::<i32>().unwrap_or(0);
    let decimals = (digits as i32 - 1 - before_point).clamp(0, 15);
    format!("{value:.*}", decimals.unsigned_abs() as usize)
}

/// A number and half the width of its interval: `29.274373 ± 0.000062`.
pub fn interval(value: f64, half: f64) -> String {
    let digits = decimals(half);
    let value = plain(value, digits);
    if half.is_finite() {
        format!("{value} ± {half:.digits$}")
    } else {
        format!("{value} ± without bound")
    }
}

/// An angular frequency: `18.02 rad/s (2.868 Hz)`.
pub fn angular_frequency(omega_rad_s: f64) -> String {
    format!("{omega_rad_s:.2} rad/s ({:.3} Hz)", omega_rad_s / TAU)
}

/// Smaller probabilities, and those as close to 1, are given as a bound.
pub(crate) const NEGLIGIBLE_PROBABILITY: f64 = 1e-4;

/// A probability in percent. Close to 0 and 1 it is given as a bound, as the tails of the distribution are not known exactly.
pub fn percent(probability: f64) -> String {
    match probability {
        p if p < NEGLIGIBLE_PROBABILITY => "below 0.01 %".into(),
        p if p > 1.0 - NEGLIGIBLE_PROBABILITY => "above 99.99 %".into(),
        p => format!("{:.2} %", 100.0 * p),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_shows_two_digits_of_its_error() {
        assert_eq!(interval(29.274_373_12, 0.000_061_6), "29.274373 ± 0.000062");
        assert_eq!(interval(-1234.5, 67.0), "\u{2212}1234 ± 67");
        assert_eq!(interval(-0.5, 0.0), "\u{2212}0.500000 ± 0.000000");
        assert_eq!(interval(0.5, f64::INFINITY), "0.500000 ± without bound");
    }

    #[test]
    fn keeps_the_significant_digits_of_a_number() {
        for (value, text) in [
            (0.034_08, "0.0341"),
            (34.08, "34.1"),
            (1640.4, "1640"),
            (100.0, "100"),
            (9.9999, "10.0"),
            (0.0, "0.00"),
        ] {
            assert_eq!(significant(value, 3), text);
        }
    }

    #[test]
    fn probabilities_close_to_0_and_1_are_bounds() {
        assert_eq!(
            [1e-9, 0.5, 0.99999].map(percent),
            ["below 0.01 %", "50.00 %", "above 99.99 %"]
        );
    }

    #[test]
    fn an_angular_frequency_has_hertz_in_brackets() {
        assert_eq!(angular_frequency(287.0), "287.00 rad/s (45.677 Hz)");
    }
}
