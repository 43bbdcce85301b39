//! A real polynomial: its value with an error bound, and its roots.

use nalgebra::{Complex, DMatrix};

use super::refinement::Values;
use super::roots::Roots;
use super::wide::horner;
use crate::state_space::eigenvalues;

/// Coefficients by falling powers; the first one is not 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Polynomial {
    falling: Vec<f64>,
}

impl Polynomial {
    /// The polynomial without leading zeros; `None` if all coefficients are 0.
    pub fn new(falling: &[f64]) -> Option<Polynomial> {
        let first = falling.iter().position(|c| *c != 0.0)?;
        Some(Polynomial {
            falling: falling[first..].to_vec(),
        })
    }

    /// The order.
    pub fn order(&self) -> usize {
        self.falling.len() - 1
    }

    /// The coefficient of the highest power.
    pub fn leading(&self) -> f64 {
        self.falling[0]
    }

    /// p(v), as if rounded once.
    pub fn value(&self, v: Complex<f64>) -> Complex<f64> {
        horner(&self.falling, v)
    }

    /// How many times `v` is a root of a polynomial whose coefficients differ from these by their rounding to double precision, at
    /// most `limit`: so many derivatives are 0.
    pub fn multiplicity_by_rounding(&self, v: Complex<f64>, limit: usize) -> usize {
        let mut rest = self.falling.clone();
        for count in 0..limit {
            let terms = rest.len() as f64;
            let is_zero = horner(&rest, v).norm() <= terms * f64::EPSILON * magnitude(&rest, v);
            if rest.len() < 2 || !is_zero {
                return count;
            }
            rest = derivative(&rest);
        }
        limit
    }

    /// The roots: eigenvalues of the balanced companion matrix, refined by Weierstrass steps (Kerner, Numer. Math. 8, 290, 1966)
    /// with values of twice the precision, so that they are those of the given coefficients to the last bits.
    /// Coefficients of 0 at the end give roots that are exactly 0. `None` if the iteration does not end, or if the coefficients
    /// span more than the range of doubles.
    pub fn roots(&self) -> Option<Roots> {
        let at_origin = self.falling.iter().rev().take_while(|c| **c == 0.0).count();
        let rest = &self.falling[..self.falling.len() - at_origin];
        let start = eigenvalues(companion(rest))?;
        let roots = Roots::from_list(&start).ok();
        // An eigenvalue that is not a number is neither real nor one of a pair.
        let mut roots = roots.filter(|roots| roots.count() == start.len())?;
        let values = Values {
            leading: rest[0],
            value: |v| horner(rest, v),
            magnitude: |v| magnitude(rest, v),
        };
        values.refine(&mut roots);
        roots.real.extend(std::iter::repeat_n(0.0, at_origin));
        Some(roots)
    }
}

fn derivative(falling: &[f64]) -> Vec<f64> {
    let order = falling.len() - 1;
    let coefficients = falling.iter().take(order).enumerate();
    coefficients.map(|(i, c)| c * (order - i) as f64).collect()
}

/// The companion matrix, whose eigenvalues are the roots.
fn companion(falling: &[f64]) -> DMatrix<f64> {
    let n = falling.len() - 1;
    DMatrix::from_fn(n, n, |i, j| match i {
        0 => -falling[j + 1] / falling[0],
        _ => f64::from(u8::from(i == j + 1)),
    })
}

/// sum |a_i| |v|^i.
fn magnitude(falling: &[f64], v: Complex<f64>) -> f64 {
    let radius = v.norm();
    falling.iter().fold(0.0, |sum, c| sum * radius + c.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sorted_real(falling: &[f64]) -> Vec<f64> {
        let roots = Polynomial::new(falling).expect("not 0").roots();
        let mut real = roots.expect("roots").real;
        real.sort_by(f64::total_cmp);
        real
    }

    #[test]
    fn roots_of_wilkinsons_polynomial_are_the_integers_to_rounding() {
        // (v - 1)(v - 2)...(v - 15): the coefficients, up to 15! = 1.3e12, are exact in double precision, and the eigenvalues of
        // the companion matrix alone are wrong in the third digit.
        let mut falling = vec![1.0];
        for root in 1..=15 {
            falling.push(0.0);
            for i in (1..falling.len()).rev() {
                falling[i] -= f64::from(root) * falling[i - 1];
            }
        }
        let roots = sorted_real(&falling);
        assert_eq!(roots.len(), 15);
        for (expected, root) in (1..).zip(roots) {
            assert!(
                (root / f64::from(expected) - 1.0).abs() < 1e-15,
                "{expected}: {root}"
            );
        }
    }

    #[test]
    fn zero_coefficients_give_lower_order_and_roots_at_the_origin() {
        assert_eq!(sorted_real(&[0.0, 2.0, 6.0, 4.0, 0.0]), [-2.0, -1.0, 0.0]);
        assert_eq!(Polynomial::new(&[0.0, 0.0]), None);
    }

    #[test]
    fn multiple_root_reproduces_the_polynomial() {
        // (v + 100)^4: single roots are known to eps^(1/4) only, but their product is the polynomial.
        let p = Polynomial::new(&[1.0, 400.0, 60_000.0, 4e6, 1e8]).expect("not 0");
        let roots = p.roots().expect("roots");
        for w in [1.0, 90.0, 3000.0] {
            let v = Complex::new(0.0, w);
            let ratio = roots.product(v) / (v + 100.0).powu(4);
            assert!((ratio - 1.0).norm() < 1e-13, "{w}: {ratio}");
        }
    }
}
