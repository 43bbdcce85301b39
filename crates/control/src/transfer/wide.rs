//! Polynomials, determinants and transfer functions of matrices in twice the working precision, for sums whose terms cancel.
//!
//! A number is an unevaluated sum of two doubles (Dekker, Numer. Math. 18, 224, 1971), with a relative precision of about 2^-104.

use std::ops::{Add, Div, Mul, Sub};

use nalgebra::{Complex, DMatrix};

use crate::state_space::StateSpace;

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

impl Sub for Wide {
    type Output = Wide;

    fn sub(self, other: Wide) -> Wide {
        self.add(other.negative())
    }
}

impl Mul for Wide {
    type Output = Wide;

    fn mul(self, other: Wide) -> Wide {
        let high = self.high * other.high;
        let rest = self.high * other.low + self.low * other.high;
        Wide::normalised(high, libm::fma(self.high, other.high, -high) + rest)
    }
}

impl Div for Wide {
    type Output = Wide;

    /// Long division with two digits, each of a double.
    fn div(self, other: Wide) -> Wide {
        let first = self.high / other.high;
        let rest = self - other * first;
        let second = rest.high / other.high;
        let rest = rest - other * second;
        Wide::normalised(first, second) + Wide::sum(rest.high / other.high, 0.0)
    }
}

#[derive(Clone, Copy, Debug, Default)]
struct WideComplex {
    re: Wide,
    im: Wide,
}

impl WideComplex {
    fn real(x: f64) -> WideComplex {
        WideComplex {
            re: Wide::sum(x, 0.0),
            im: Wide::default(),
        }
    }

    fn of(v: Complex<f64>) -> WideComplex {
        WideComplex {
            im: Wide::sum(v.im, 0.0),
            ..WideComplex::real(v.re)
        }
    }

    fn size(self) -> f64 {
        self.re.high.abs() + self.im.high.abs()
    }

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

impl Mul<f64> for WideComplex {
    type Output = WideComplex;

    fn mul(self, factor: f64) -> WideComplex {
        WideComplex {
            re: self.re * factor,
            im: self.im * factor,
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

impl Sub for WideComplex {
    type Output = WideComplex;

    fn sub(self, other: WideComplex) -> WideComplex {
        WideComplex {
            re: self.re - other.re,
            im: self.im - other.im,
        }
    }
}

impl Mul for WideComplex {
    type Output = WideComplex;

    fn mul(self, other: WideComplex) -> WideComplex {
        WideComplex {
            re: self.re * other.re - self.im * other.im,
            im: self.re * other.im + self.im * other.re,
        }
    }
}

impl Div for WideComplex {
    type Output = WideComplex;

    fn div(self, other: WideComplex) -> WideComplex {
        let square = other.re * other.re + other.im * other.im;
        let conjugate = WideComplex {
            im: other.im.negative(),
            ..other
        };
        let product = self * conjugate;
        WideComplex {
            re: product.re / square,
            im: product.im / square,
        }
    }
}

/// Rows of v - A, each followed by that of -B; and the row C, D at the end.
fn bordered(system: &StateSpace, v: Complex<f64>) -> Vec<Vec<WideComplex>> {
    let n = system.a.nrows();
    let entry = |i: usize, j: usize| {
        let constant = match (i < n, j < n) {
            (true, true) => -system.a[(i, j)],
            (true, false) => -system.b[(i, 0)],
            (false, true) => system.c[(0, j)],
            (false, false) => system.d,
        };
        if i == j && i < n {
            WideComplex::of(v) + WideComplex::real(constant)
        } else {
            WideComplex::real(constant)
        }
    };
    let row = |i: usize| (0..=n).map(|j| entry(i, j)).collect();
    (0..=n).map(row).collect()
}

/// Eliminates the first columns of a bordered matrix with partial pivoting among all rows but the last one. Returns the determinant of
/// the part without border, and the last entry, C (v - A)^-1 B + D.
fn eliminated(mut rows: Vec<Vec<WideComplex>>) -> (WideComplex, WideComplex) {
    let n = rows.len() - 1;
    let mut determinant = WideComplex::real(1.0);
    for step in 0..n {
        let size = |row: &usize| rows[*row][step].size();
        let pivot = (step..n).max_by(|a, b| size(a).total_cmp(&size(b)));
        let pivot = pivot.unwrap_or(step);
        if pivot != step {
            rows.swap(step, pivot);
            determinant = determinant * -1.0;
        }
        let (above, below) = rows.split_at_mut(step + 1);
        let pivot_row = &above[step];
        determinant = determinant * pivot_row[step];
        for row in below {
            subtract(row, pivot_row, step);
        }
    }
    (determinant, rows[n][n])
}

fn subtract(row: &mut [WideComplex], pivot_row: &[WideComplex], step: usize) {
    if row[step].size() == 0.0 {
        return;
    }
    let factor = row[step] / pivot_row[step];
    for (entry, pivot) in row.iter_mut().zip(pivot_row).skip(step + 1) {
        *entry = *entry - factor * *pivot;
    }
}

/// det(v - A), as if rounded once.
pub(super) fn characteristic(a: &DMatrix<f64>, v: Complex<f64>) -> Complex<f64> {
    let n = a.nrows();
    let system = StateSpace {
        a: a.clone(),
        b: DMatrix::zeros(n, 1),
        c: DMatrix::zeros(1, n),
        d: 0.0,
    };
    eliminated(bordered(&system, v)).0.rounded()
}

/// det [v - A, -B; C, D], the numerator of the response over det(v - A).
pub(super) fn numerator(system: &StateSpace, v: Complex<f64>) -> Complex<f64> {
    let (determinant, response) = eliminated(bordered(system, v));
    (determinant * response).rounded()
}

/// C (v - A)^-1 B + D, as if rounded once unless more than 15 digits cancel.
pub(super) fn response(system: &StateSpace, v: Complex<f64>) -> Complex<f64> {
    eliminated(bordered(system, v)).1.rounded()
}

/// p(v) by Horner's rule; coefficients by falling powers. The result is that of exact arithmetic, rounded, unless more than 30
/// digits cancel.
pub(super) fn horner(falling: &[f64], v: Complex<f64>) -> Complex<f64> {
    let value = falling.iter().fold(WideComplex::default(), |value, &c| {
        value * v + WideComplex::real(c)
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

    #[test]
    fn quotient_has_twice_the_precision() {
        let third = Wide::sum(1.0, 0.0) / Wide::sum(3.0, 0.0);
        let rest = third * 3.0 - Wide::sum(1.0, 0.0);
        assert!(rest.rounded().abs() < WIDE_EPSILON, "{third:?}");
        assert_eq!(third.high, 1.0 / 3.0);
    }

    #[test]
    fn determinant_and_response_of_a_companion_matrix_are_exact() {
        // (v - 1)^8, whose value at 1 + 2^-10 is 2^-80; and the response 1/(v - 1)^8.
        let falling = [8.0, -28.0, 56.0, -70.0, 56.0, -28.0, 8.0, -1.0];
        let a = DMatrix::from_fn(8, 8, |i, j| match i {
            0 => falling[j],
            _ => f64::from(u8::from(i == j + 1)),
        });
        let v = Complex::new(1.0 + libm::exp2(-10.0), 0.0);
        let found = characteristic(&a, v).re / libm::exp2(-80.0);
        assert!((found - 1.0).abs() < 1e-3, "{found}");
        let system = StateSpace {
            b: DMatrix::from_fn(8, 1, |i, _| f64::from(u8::from(i == 0))),
            c: DMatrix::from_fn(1, 8, |_, j| f64::from(u8::from(j == 7))),
            d: 0.0,
            a,
        };
        let found = response(&system, v).re * libm::exp2(-80.0);
        assert!((found - 1.0).abs() < 1e-3, "{found}");
    }
}
