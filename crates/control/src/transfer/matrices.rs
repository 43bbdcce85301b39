//! Poles, zeros and response of a state-space system with one input and one output.

use nalgebra::{Complex, DMatrix, DVector};

use super::refinement::Values;
use super::roots::Roots;
use super::wide::{characteristic, numerator, response};
use crate::state_space::{StateSpace, balance, eigenvalues};

/// A system in balanced coordinates, with B and C of the magnitude of A: H(v) = scale (C (v - A)^-1 B + D).
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Matrices {
    system: StateSpace,
    scale: f64,
}

/// Error of the eigenvalue iteration and of the elimination, per order and in units of the norm: both are backward stable, and
/// the constant is far below 10 in practice (Golub and Van Loan, *Matrix Computations*, sections 3.3 and 7.5).
const BACKWARD_ERROR: f64 = 10.0 * f64::EPSILON;

/// A point far away from all zeros, over the largest of them.
const FAR: f64 = 4.0;

/// Largest distance of an integrator from the origin or from z = 1, relative to the norm of A. A pole farther away is a slow one, even
/// if rounding could have moved it that far.
const INTEGRATOR_DISTANCE: f64 = 1e-7;

impl Matrices {
    /// Balances a system. Its response does not change, not even in its last bit, because all factors are powers of two.
    pub fn new(system: &StateSpace) -> Matrices {
        let target = non_zero(system.a.amax());
        let factor = |part: &DMatrix<f64>| power_of_two(target / non_zero(part.amax()));
        let (input, output) = (factor(&system.b), factor(&system.c));
        let scaled = StateSpace {
            a: system.a.clone(),
            b: &system.b * input,
            c: &system.c * output,
            d: system.d * input * output,
        };
        Matrices {
            system: balanced(&scaled),
            scale: 1.0 / (input * output),
        }
    }

    /// Number of states.
    pub fn order(&self) -> usize {
        self.system.a.nrows()
    }

    /// The poles: the eigenvalues of A, refined by the values of det(v - A) in twice the working precision.
    pub fn poles(&self) -> Option<Roots> {
        let mut poles = roots_of(eigenvalues(self.system.a.clone())?)?;
        let values = Values {
            leading: 1.0,
            value: |v| characteristic(&self.system.a, v),
            magnitude: |v| determinant_bound(&self.system.a, v),
        };
        values.refine(&mut poles);
        Some(poles)
    }

    /// H(v), as if rounded once.
    pub fn exact_response(&self, v: Complex<f64>) -> Complex<f64> {
        response(&self.system, v) * self.scale
    }

    /// How many of the poles may be integrators that the error of the iteration has moved, most first: two, one, or none.
    ///
    /// A double eigenvalue moves by the square root of the error of the matrix.
    pub fn integrators(&self, integrator: f64, poles: &Roots) -> Vec<usize> {
        let (n, norm) = (self.order() as f64, non_zero(self.system.a.norm()));
        let double = (BACKWARD_ERROR * n).sqrt() * norm;
        let second = poles.distances(integrator).get(1).copied();
        let is_double = second.is_some_and(|distance| distance <= double);
        let distance = |root: &&f64| (**root - integrator).abs();
        let nearest = (poles.real.iter()).min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let is_single = nearest.is_some_and(|root| self.is_eigenvalue(integrator, *root));
        let counts = [is_double.then_some(2), is_single.then_some(1)];
        counts.into_iter().flatten().collect()
    }

    /// Whether a real eigenvalue is `integrator`, apart from the error of the iteration.
    ///
    /// The error of a simple eigenvalue is that of the matrix times |x| |y|/|y' x| with its right and left eigenvectors x, y.
    fn is_eigenvalue(&self, integrator: f64, found: f64) -> bool {
        let (n, norm) = (self.order(), non_zero(self.system.a.norm()));
        let difference = (found - integrator).abs();
        if difference > INTEGRATOR_DISTANCE * norm {
            return false;
        }
        // Inverse iteration beside the eigenvalue: one step from a vector of ones gives the eigenvector.
        let beside = found + f64::EPSILON * norm;
        let shifted = &self.system.a - DMatrix::identity(n, n) * beside;
        let ones = DVector::from_element(n, 1.0);
        let right = shifted.clone().lu().solve(&ones);
        let left = shifted.transpose().lu().solve(&ones);
        let (Some(right), Some(left)) = (right, left) else {
            return true; // an eigenvalue to the last bit
        };
        let condition = right.norm() * left.norm() / left.dot(&right).abs();
        difference <= BACKWARD_ERROR * n as f64 * norm * condition
    }

    /// The zeros: the finite generalised eigenvalues of the Rosenbrock pencil [A - v, B; C, D]. `None` if the response is 0 or
    /// the iteration does not end.
    pub fn zeros(&self) -> Option<Roots> {
        let roots = roots_of(finite_zeros(&self.system)?)?;
        Some(self.refined(roots))
    }

    /// H(v), and the bound of the relative error that backward stable algorithms have there:
    ///
    /// ```text
    ///  (|x| (|A| |y| + |B|) + |C| |y| + |D|)/|H|,  y = (v - A)^-1 B,  x' = C (v - A)^-1
    /// ```
    ///
    /// times [`BACKWARD_ERROR`] and the order. Infinite at a pole.
    pub fn response(&self, v: Complex<f64>) -> (Complex<f64>, f64) {
        let (system, n) = (&self.system, self.order());
        let shifted = DMatrix::identity(n, n) * v - system.a.map(Complex::from);
        let (b, c) = (system.b.map(Complex::from), system.c.map(Complex::from));
        let output = shifted.transpose().lu().solve(&c.transpose());
        let state = shifted.lu().solve(&b);
        let (Some(x), Some(y)) = (output, state) else {
            return (Complex::new(f64::INFINITY, 0.0), f64::INFINITY);
        };
        let value = (&c * &y)[0] + system.d;
        let (a_norm, b_norm, c_norm) = (system.a.norm(), system.b.norm(), system.c.norm());
        let size = x.norm() * (a_norm * y.norm() + b_norm) + c_norm * y.norm() + system.d.abs();
        let error = BACKWARD_ERROR * (n + 1) as f64 * size / value.norm();
        (value * self.scale, error)
    }

    /// The zeros, refined by the values of their polynomial in twice the working precision.
    fn refined(&self, mut zeros: Roots) -> Roots {
        let values = Values {
            leading: self.leading(&zeros),
            value: |v| numerator(&self.system, v),
            magnitude: |v| numerator_bound(&self.system, v),
        };
        values.refine(&mut zeros);
        zeros
    }

    /// The coefficient of the highest power of the numerator, from its value far away from the zeros.
    fn leading(&self, zeros: &Roots) -> f64 {
        let largest = zeros.all().map(|zero| zero.norm()).fold(0.0, f64::max);
        let far = Complex::new(FAR * largest.max(self.system.a.amax()), 0.0);
        (numerator(&self.system, far) / zeros.product(far)).re
    }
}

/// Hadamard's bound of det(v - A): the product of the norms of the rows.
fn determinant_bound(a: &DMatrix<f64>, v: Complex<f64>) -> f64 {
    let norms = a.row_iter().map(|row| row.norm() + v.norm());
    norms.product()
}

/// The same bound for the numerator, the determinant of [v - A, -B; C, D].
fn numerator_bound(system: &StateSpace, v: Complex<f64>) -> f64 {
    let rows = system.a.row_iter().zip(system.b.iter());
    let norms = rows.map(|(row, b)| row.norm() + b.abs() + v.norm());
    norms.product::<f64>() * (system.c.norm() + system.d.abs())
}

fn non_zero(x: f64) -> f64 {
    if x > 0.0 { x } else { 1.0 }
}

fn power_of_two(x: f64) -> f64 {
    libm::exp2(libm::round(libm::log2(x)))
}

fn roots_of(list: Vec<Complex<f64>>) -> Option<Roots> {
    let roots = Roots::from_list(&list).ok()?;
    // An eigenvalue that is not a number is neither real nor one of a pair.
    (roots.count() == list.len()).then_some(roots)
}

/// The system in coordinates in which the states have similar magnitudes, input and output included.
fn balanced(system: &StateSpace) -> StateSpace {
    let n = system.a.nrows();
    let mut bordered = DMatrix::zeros(n + 1, n + 1);
    bordered.view_mut((0, 0), (n, n)).copy_from(&system.a);
    bordered.view_mut((0, n), (n, 1)).copy_from(&system.b);
    bordered.view_mut((n, 0), (1, n)).copy_from(&system.c);
    balance(&mut bordered, n);
    StateSpace {
        a: bordered.view((0, 0), (n, n)).into_owned(),
        b: bordered.view((0, n), (n, 1)).into_owned(),
        c: bordered.view((n, 0), (1, n)).into_owned(),
        d: system.d,
    }
}

/// Finite zeros of the pencil. Where D is 0, an orthogonal change of coordinates makes the output a single state, y = g x_n; the
/// zeros are those of the other states with x_n = 0, whose output is x_n' (Emami-Naeini and Van Dooren, Automatica 18, 415, 1982,
/// for one input and one output). Each step removes one zero at infinity.
fn finite_zeros(system: &StateSpace) -> Option<Vec<Complex<f64>>> {
    let rounding = BACKWARD_ERROR * (system.a.nrows() + 1) as f64;
    let no_input = rounding * system.b.norm();
    let no_output = rounding * system.c.norm().max(system.a.norm());
    let mut rest = system.clone();
    while rest.d.abs() <= no_input {
        if rest.c.norm() <= no_output {
            return None;
        }
        rest = without_zero_at_infinity(&rest);
    }
    eigenvalues(&rest.a - &rest.b * &rest.c / rest.d)
}

/// One step of [`finite_zeros`] for a system with D = 0 and C other than 0.
fn without_zero_at_infinity(system: &StateSpace) -> StateSpace {
    let last = system.a.nrows() - 1;
    // The reflection I - 2 v v'/(v' v) that turns C into a multiple of the last unit vector.
    let mut v = system.c.transpose();
    v[last] += v.norm().copysign(v[last]);
    let reflection =
        DMatrix::identity(last + 1, last + 1) - &v * v.transpose() * (2.0 / v.norm_squared());
    let a = &reflection * &system.a * &reflection;
    let b = &reflection * &system.b;
    StateSpace {
        a: a.view((0, 0), (last, last)).into_owned(),
        b: b.view((0, 0), (last, 1)).into_owned(),
        c: a.view((last, 0), (1, last)).into_owned(),
        d: b[last],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn system(a: &[f64], b: &[f64], c: &[f64], d: f64) -> Matrices {
        let n = b.len();
        Matrices::new(&StateSpace {
            a: DMatrix::from_row_slice(n, n, a),
            b: DMatrix::from_row_slice(n, 1, b),
            c: DMatrix::from_row_slice(1, n, c),
            d,
        })
    }

    #[test]
    fn zeros_are_those_of_the_numerator_of_the_controllable_form() {
        // 3 (s + 2)/(s^3 + 6 s^2 + 11 s + 6), in time units of 1 ms: entries of A from 1 to 6e9.
        let (t, a) = (1e3, [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, -6e9, -11e6, -6e3]);
        let matrices = system(&a, &[0.0, 0.0, 1.0], &[6e3, 3.0, 0.0], 0.0);
        let zeros = matrices.zeros().expect("zeros");
        assert_eq!((zeros.real.len(), zeros.pairs.len()), (1, 0));
        assert!(
            (zeros.real[0] / (-2.0 * t) - 1.0).abs() < 1e-13,
            "{zeros:?}"
        );
        let mut poles = matrices.poles().expect("poles").real;
        poles.sort_by(f64::total_cmp);
        for (pole, expected) in poles.iter().zip([-3.0, -2.0, -1.0]) {
            assert!((pole / (expected * t) - 1.0).abs() < 1e-12, "{pole}");
        }
        // H(j 1000 rad/s): 3 (j + 2)/((j + 1)(j + 2)(j + 3)) per 1e6 = 3/(2 + 4j)/1e6.
        let (value, error) = matrices.response(Complex::new(0.0, t));
        let expected = Complex::new(3e-6, 0.0) / Complex::new(2.0, 4.0);
        assert!(
            (value / expected - 1.0).norm() < error.min(1e-12),
            "{value}"
        );
    }

    #[test]
    fn direct_feedthrough_gives_as_many_zeros_as_poles() {
        // 2 + 1/(s + 1) = (2 s + 3)/(s + 1).
        let matrices = system(&[-1.0], &[1.0], &[1.0], 2.0);
        let zeros = matrices.zeros().expect("zeros");
        assert!((zeros.real[0] + 1.5).abs() < 1e-15);
    }

    #[test]
    fn system_without_response_has_no_zeros() {
        // The second state is driven, the first one observed, and they are not coupled.
        let matrices = system(&[-1.0, 0.0, 0.0, -2.0], &[0.0, 1.0], &[1.0, 0.0], 0.0);
        assert_eq!(matrices.zeros(), None);
        assert_eq!(system(&[-1.0], &[1.0], &[0.0], 0.0).zeros(), None);
    }
}
