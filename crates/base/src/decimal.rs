//! Numbers in text output.

use std::fmt::{Display, Formatter, LowerExp, Result};

/// A number that is printed like an `f64`, but without a negative zero: a value that rounds to zero is `0.00` or `+0.00`.
///
/// ```
/// use bench_base::decimal::Decimal;
///
/// assert_eq!(format!("{:+.4}", -1e-9), "-0.0000");
/// assert_eq!(format!("{:+.4}", Decimal(-1e-9)), "+0.0000");
/// assert_eq!(format!("{:8.2}", Decimal(-1.5)), "   -1.50");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decimal(pub f64);

impl Display for Decimal {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let rounds_to_zero = f
            .precision()
            .is_some_and(|decimals| format!("{:.decimals$}", self.0).parse::<f64>() == Ok(0.0));
        if rounds_to_zero {
            Display::fmt(&0.0, f)
        } else {
            // The sum of the two zeros is the positive one.
            Display::fmt(&(self.0 + 0.0), f)
        }
    }
}

impl LowerExp for Decimal {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        LowerExp::fmt(&(self.0 + 0.0), f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn prints_no_negative_zero() {
        for value in [-0.0, -1e-9, -0.0049, 0.0049] {
            assert_eq!(format!("{:.2}", Decimal(value)), "0.00");
            assert_eq!(format!("{:+.2}", Decimal(value)), "+0.00");
        }
        assert_eq!(format!("{:+.1e}", Decimal(-0.0)), "+0.0e0");
        for value in [-0.0051, 0.0051, -1234.5, f64::NAN, f64::INFINITY] {
            assert_eq!(format!("{:+.2}", Decimal(value)), format!("{value:+.2}"));
            assert_eq!(format!("{:9.3e}", Decimal(value)), format!("{value:9.3e}"));
        }
    }
}
