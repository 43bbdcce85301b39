//! Polynomials in twice the working precision, for sums whose terms cancel.
//!
//! A number is an unevaluated sum of two doubles (Dekker, Numer. Math. 18, 224, 1971), with a relative precision of about 2^-104.

use std::ops::{Add, Mul};

use nalgebra::Complex;

/// Relative error of a few operations.
pub(super) const WIDE_EPSILON: f64 = 1e-31;

/// high + low, where `low` is at most half a unit in the last place of `high`.
#[derive(Clone, Copy, Debug, Default)]
struct Wide {
    high: f64,
    low: f64,
}

impl Wide {
    /// a + b without rounding (Knuth).
    fn sum(a: f64, b: f64) -> Wide {
        let high = a + b;
        let part = high - a;
        Wide {
            high,
            low: (a - (high - part)) + (b - part),
        }
    }

    /// high + low, for |high| >= |low|.
    fn normalised(high: f64, low: f64) -> Wide {
        let sum = high + low;
        Wide {
            high: sum,
            low: low - (sum - high),
        }
    }

    fn negative(self) -> Wide {
        Wide {
            high: -self.high,
            low: -self.low,
        }
    }

    fn rounded(self) -> f64 {
        self.high + self.low
    }
}

impl Add for Wide {
    type Output = Wide;

    fn add(self, other: Wide) -> Wide {
        let (high, low) = (
            Wide::sum(self.high, other.high),
            Wide::sum(self.low, other.low),
        );
        let first = Wide::normalised(high.high, high.low + low.high);
        Wide::normalised(first.high, first.low + low.low)
    }
}

impl Mul<f64> for Wide {
    type Output = Wide;

    fn mul(self, factor: f64) -> Wide {
        let high = self.high * factor;
        let low = libm::fma(self.high, factor, -high) + self.low * factor;
        Wide::normalised(high, low)
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct WideComplex {
    re: Wide,
    im: Wide,
}

impl WideComplex {
    fn rounded(self) -> Complex<f64> {
        Complex::new(self.re.rounded(), self.im.rounded())
    }
}

impl Add for WideComplex {
    type Output = WideComplex;

    fn add(self, other: WideComplex) -> WideComplex {
        WideComplex {
            re: self.re + other.re,
            im: self.im + other.im,
        }
    }
}

impl Mul<Complex<f64>> for WideComplex {
    type Output = WideComplex;

    fn mul(self, factor: Complex<f64>) -> WideComplex {
        WideComplex {
            re: self.re * factor.re + (self.im * factor.im).negative(),
            im: self.re * factor.im + self.im * factor.re,
        }
    }
}

/// p(v) by Horner's rule; coefficients by falling powers. The result is that of exact arithmetic, rounded, unless more than 30
/// digits cancel.
pub(super) fn horner(falling: &[f64], v: Complex<f64>) -> Complex<f64> {
    let value = falling.iter().fold(WideComplex::default(), |value, &c| {
        let constant = WideComplex {
            re: Wide::sum(c, 0.0),
            im: Wide::default(),
        };
        value * v + constant
    });
    value.rounded()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn value_near_a_multiple_root_is_exact_where_doubles_cancel() {
        // (v - 1)^8 at 1 + 2^-10 is 2^-80; in double precision the terms, which sum up to 256, leave no digit.
        let falling = [1.0, -8.0, 28.0, -56.0, 70.0, -56.0, 28.0, -8.0, 1.0];
        let distance = libm::exp2(-10.0);
        let value = horner(&falling, Complex::new(1.0 + distance, 0.0));
        // The rounding of the eight products is 8 * 256 * 2^-104 = 1e-28, i.e. 1e-4 of the value 8e-25.
        assert!((value.re / libm::exp2(-80.0) - 1.0).abs() < 1e-4, "{value}");
        assert_eq!(value.im, 0.0);
    }

    #[test]
    fn value_at_a_complex_point_is_the_product_of_the_factors() {
        // (v^2 + 1)(v - 2) = v^3 - 2 v^2 + v - 2 at v = 1 + j: v^2 + 1 = 1 + 2j, times (-1 + j) = -3 - j.
        let value = horner(&[1.0, -2.0, 1.0, -2.0], Complex::new(1.0, 1.0));
        assert_eq!(value, Complex::new(-3.0, -1.0));
    }
}
