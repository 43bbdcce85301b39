//! Roots that are those of their polynomial to the last bits.

use nalgebra::Complex;

use super::roots::Roots;
use super::wide::WIDE_EPSILON;
use bench_base::numeric::{is_within, larger};

/// Largest number of refining steps. Simple roots need two or three, a root of multiplicity m converges by 1 - 1/m per step.
const MAX_STEPS: usize = 100;
/// Largest first step relative to its root. A larger one is not a refinement.
const MAX_STEP: f64 = 0.1;

/// A polynomial by its values in twice the working precision.
pub(super) struct Values<V, M> {
    /// The coefficient of the highest power.
    pub leading: f64,
    /// p(v).
    pub value: V,
    /// A bound of the terms of p(v): the scale of its rounding errors.
    pub magnitude: M,
}

impl<V: Fn(Complex<f64>) -> Complex<f64>, M: Fn(Complex<f64>) -> f64> Values<V, M> {
    /// Moves all roots at once by the steps of Newton's method for the coefficients as functions of the roots (Kerner, Numer. Math. 8,
    /// 290, 1966). The coefficients of the product converge also where roots are close to each other and single ones do not. Ends
    /// when the steps no longer decrease, or when rounding makes a noticeable part of them.
    pub fn refine(&self, roots: &mut Roots) {
        let mut previous = MAX_STEP;
        for _ in 0..MAX_STEPS {
            let steps: Vec<Step> = upper(roots).map(|root| self.step(roots, root)).collect();
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

    fn step(&self, roots: &Roots, root: Complex<f64>) -> Step {
        // An integrator of matrices is exact; its relative steps have no meaning.
        if root.norm() == 0.0 {
            return Step::default();
        }
        let mut slope = Complex::new(self.leading, 0.0);
        let mut itself = true;
        for other in roots.all() {
            if itself && other == root {
                itself = false;
            } else {
                slope *= root - other;
            }
        }
        let change = (self.value)(root) / slope;
        Step {
            change,
            size: change.norm() / root.norm(),
            noise: WIDE_EPSILON * (self.magnitude)(root) / (slope * root).norm(),
        }
    }
}

/// The real roots, and one of each pair.
fn upper(roots: &Roots) -> impl Iterator<Item = Complex<f64>> + '_ {
    let real = roots.real.iter().map(|root| Complex::new(*root, 0.0));
    real.chain(roots.pairs.iter().copied())
}

/// A change of a root.
#[derive(Default)]
struct Step {
    /// p(r)/(a prod(r - other root)).
    change: Complex<f64>,
    /// The change relative to the root.
    size: f64,
    /// The part of the size that rounding makes.
    noise: f64,
}
