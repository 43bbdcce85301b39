//! A real polynomial: its value with an error bound, and its roots.

use nalgebra::{Complex, DMatrix};

use super::roots::Roots;
use super::wide::{WIDE_EPSILON, horner};
use crate::control::state_space::eigenvalues;
use crate::util::numeric::{is_within, larger};

/// Coefficients by falling powers; the first one is not 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Polynomial {
    falling: Vec<f64>,
}

/// Largest number of refining steps. Simple roots need two or three, a root of multiplicity m converges by 1 - 1/m per step.
const MAX_STEPS: usize = 100;
/// Largest first step relative to its root. A larger one is not a refinement.
const MAX_STEP: f64 = 0.1;

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

    /// sum |a_i| |v|^i: the scale of rounding errors of p(v).
    pub fn magnitude(&self, v: Complex<f64>) -> f64 {
        magnitude(&self.falling, v)
    }

    /// Whether `v` is a root of a polynomial whose coefficients differ from these by their rounding to double precision.
    pub fn is_root_by_rounding(&self, v: Complex<f64>) -> bool {
        let terms = self.falling.len() as f64;
        self.value(v).norm() <= terms * f64::EPSILON * self.magnitude(v)
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
        refine(rest, &mut roots);
        roots.real.extend(std::iter::repeat_n(0.0, at_origin));
        Some(roots)
    }
}

/// The companion matrix, whose eigenvalues are the roots.
fn companion(falling: &[f64]) -> DMatrix<f64> {
    let n = falling.len() - 1;
    DMatrix::from_fn(n, n, |i, j| match i {
        0 => -falling[j + 1] / falling[0],
        _ => f64::from(u8::from(i == j + 1)),
    })
}

/// Moves all roots at once by the steps of Newton's method for the coefficients as functions of the roots. The coefficients of
/// the product converge also where roots are close to each other and single ones do not. Ends when the steps no longer decrease,
/// or when rounding makes a noticeable part of them.
fn refine(falling: &[f64], roots: &mut Roots) {
    let mut previous = MAX_STEP;
    for _ in 0..MAX_STEPS {
        let steps = upper(roots).map(|root| Step::of(falling, roots, root));
        let steps: Vec<Step> = steps.collect();
        let largest = steps.iter().map(|step| step.size).fold(0.0, larger);
        let is_noise = steps.iter().any(|step| step.noise > f64::EPSILON);
        // Also if a step is not a number: two roots are equal.
        if is_noise || !is_within(largest, previous) || largest < 0.5 * f64::EPSILON {
            return;
        }
        previous = largest;
        let (real, pairs) = steps.split_at(roots.real.len());
        for (root, step) in roots.real.iter_mut().zip(real) {
            *root -= step.change.re;
        }
        for (root, step) in roots.pairs.iter_mut().zip(pairs) {
            *root -= step.change;
        }
    }
}

/// The real roots, and one of each pair.
fn upper(roots: &Roots) -> impl Iterator<Item = Complex<f64>> + '_ {
    let real = roots.real.iter().map(|root| Complex::new(*root, 0.0));
    real.chain(roots.pairs.iter().copied())
}

/// A change of a root.
struct Step {
    /// p(r)/(a prod(r - other root)).
    change: Complex<f64>,
    /// The change relative to the root.
    size: f64,
    /// The part of the size that rounding makes.
    noise: f64,
}

impl Step {
    fn of(falling: &[f64], roots: &Roots, root: Complex<f64>) -> Step {
        let mut slope = Complex::new(falling[0], 0.0);
        let mut itself = true;
        for other in roots.all() {
            if itself && other == root {
                itself = false;
            } else {
                slope *= root - other;
            }
        }
        let change = horner(falling, root) / slope;
        Step {
            change,
            size: change.norm() / root.norm(),
            noise: WIDE_EPSILON * magnitude(falling, root) / (slope * root).norm(),
        }
    }
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
