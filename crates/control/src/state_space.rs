//! Linear systems with one input and one output as matrices: cascades of them, and the poles of a closed loop.

use nalgebra::{Complex, DMatrix};

use super::{Biquad, Section};
use bench_plant::{Mode, linear_algebra};

/// x' (or x+) = A x + B u, y = C x + D u.
#[derive(Clone, Debug, PartialEq)]
pub struct StateSpace {
    /// n by n.
    pub a: DMatrix<f64>,
    /// n by 1.
    pub b: DMatrix<f64>,
    /// 1 by n.
    pub c: DMatrix<f64>,
    /// Direct feedthrough.
    pub d: f64,
}

impl StateSpace {
    /// A system of N states from the rows of A, from B, C and D.
    ///
    /// ```
    /// use bench_control::StateSpace;
    /// use nalgebra::Complex;
    ///
    /// // x+ = 0.5 x + u, y = x: 1/(z - 0.5).
    /// let system = StateSpace::from_rows([[0.5]], [1.0], [1.0], 0.0);
    /// assert_eq!(system.response(Complex::new(1.0, 0.0)), Complex::new(2.0, 0.0));
    /// ```
    pub fn from_rows<const N: usize>(a: [[f64; N]; N], b: [f64; N], c: [f64; N], d: f64) -> Self {
        StateSpace::new(a.as_flattened(), &b, &c, d)
    }

    /// A system from A row by row, B and C.
    fn new(a: &[f64], b: &[f64], c: &[f64], d: f64) -> Self {
        let n = b.len();
        StateSpace {
            a: DMatrix::from_row_slice(n, n, a),
            b: DMatrix::from_row_slice(n, 1, b),
            c: DMatrix::from_row_slice(1, n, c),
            d,
        }
    }

    /// y = d u.
    pub fn gain(d: f64) -> Self {
        StateSpace {
            a: DMatrix::zeros(0, 0),
            b: DMatrix::zeros(0, 1),
            c: DMatrix::zeros(1, 0),
            d,
        }
    }

    /// C (z - A)^-1 B + D; infinite at a pole.
    pub fn response(&self, z: Complex<f64>) -> Complex<f64> {
        let n = self.a.nrows();
        let shifted = DMatrix::identity(n, n) * z - self.a.map(Complex::from);
        match shifted.lu().solve(&self.b.map(Complex::from)) {
            Some(state) => (self.c.map(Complex::from) * state)[0] + self.d,
            None => Complex::new(f64::INFINITY, 0.0),
        }
    }

    /// This system, its output into `next`.
    pub fn then(&self, next: &StateSpace) -> StateSpace {
        let (n, m) = (self.a.nrows(), next.a.nrows());
        let mut a = DMatrix::zeros(n + m, n + m);
        a.view_mut((0, 0), (n, n)).copy_from(&self.a);
        a.view_mut((n, n), (m, m)).copy_from(&next.a);
        a.view_mut((n, 0), (m, n)).copy_from(&(&next.b * &self.c));
        let mut b = DMatrix::zeros(n + m, 1);
        b.view_mut((0, 0), (n, 1)).copy_from(&self.b);
        b.view_mut((n, 0), (m, 1)).copy_from(&(&next.b * self.d));
        let mut c = DMatrix::zeros(1, n + m);
        c.view_mut((0, 0), (1, n)).copy_from(&(&self.c * next.d));
        c.view_mut((0, n), (1, m)).copy_from(&next.c);
        let d = self.d * next.d;
        StateSpace { a, b, c, d }
    }

    /// Poles of the loop closed by u = -y: the eigenvalues of A - B C/(1 + D). `None` if the iteration does not end.
    pub fn closed_poles(&self) -> Option<Vec<Complex<f64>>> {
        eigenvalues(&self.a - &self.b * &self.c / (1.0 + self.d))
    }

    /// The eigenvalues of A. `None` if the iteration does not end.
    pub fn poles(&self) -> Option<Vec<Complex<f64>>> {
        eigenvalues(self.a.clone())
    }

    /// Modes from current to displacement, in continuous time.
    pub(super) fn of_modes(modes: &[Mode], force_constant_n_per_a: f64) -> Self {
        let n = 2 * modes.len();
        let mut a = DMatrix::zeros(n, n);
        let mut b = DMatrix::zeros(n, 1);
        let mut c = DMatrix::zeros(1, n);
        for (index, mode) in modes.iter().enumerate() {
            let (first, w, scale) = (2 * index, mode.omega_rad_s, mode.rate_scale_rad_s());
            a[(first, first + 1)] = scale;
            a[(first + 1, first)] = -w;
            a[(first + 1, first + 1)] = -2.0 * mode.damping_ratio * w;
            b[(first + 1, 0)] = mode.force_gain * force_constant_n_per_a / scale;
            c[(0, first)] = mode.sensor_gain;
        }
        StateSpace { a, b, c, d: 0.0 }
    }
}

impl From<&Biquad> for StateSpace {
    fn from(section: &Biquad) -> Self {
        let (a, b, c, d) = section.state_space();
        StateSpace {
            a: DMatrix::from_column_slice(2, 2, a.as_slice()),
            b: DMatrix::from_column_slice(2, 1, b.as_slice()),
            c: DMatrix::from_column_slice(1, 2, c.as_slice()),
            d,
        }
    }
}

/// Controllable form. Time is scaled by the frequency of the pole pair, so that the entries have similar magnitudes.
impl From<&Section> for StateSpace {
    fn from(section: &Section) -> Self {
        let order = section.poles().len();
        let lead = section.denominator[order];
        let n = section.numerator.map(|c| c / lead);
        let m = section.denominator.map(|c| c / lead);
        let d = n[order];
        match order {
            0 => StateSpace::gain(d),
            1 => StateSpace::new(&[-m[0]], &[1.0], &[n[0] - m[0] * d], d),
            _ => {
                let w = if m[0] > 0.0 { m[0].sqrt() } else { 1.0 };
                let c = [(n[0] - m[0] * d) / w, n[1] - m[1] * d];
                StateSpace::new(&[0.0, w, -m[0] / w, -m[1]], &[0.0, 1.0], &c, d)
            }
        }
    }
}

/// The eigenvalues of a matrix, balanced first. `None` if an entry is not finite or the iteration does not end.
pub(super) fn eigenvalues(mut matrix: DMatrix<f64>) -> Option<Vec<Complex<f64>>> {
    let order = matrix.nrows();
    balance(&mut matrix, order);
    linear_algebra::eigenvalues(&matrix)
}

/// Scales rows and columns by powers of two until they have similar magnitudes (Osborne 1960). Such a similarity changes no
/// eigenvalue, not even in its last bit, and the iteration resolves poles beside entries that are many decades larger. Only the
/// first `count` rows and columns are scaled; inputs and outputs of a system may follow.
pub(super) fn balance(matrix: &mut DMatrix<f64>, count: usize) {
    for _ in 0..100 {
        let mut settled = true;
        for i in 0..count {
            settled &= balance_row_and_column(matrix, i);
        }
        if settled {
            return;
        }
    }
}

/// Whether row and column `i` had similar magnitudes before.
fn balance_row_and_column(matrix: &mut DMatrix<f64>, i: usize) -> bool {
    let row = off_diagonal_sum(matrix.row(i).iter(), i);
    let column = off_diagonal_sum(matrix.column(i).iter(), i);
    if row == 0.0 || column == 0.0 {
        return true;
    }
    let factor = libm::exp2(libm::round(0.5 * libm::log2(row / column)));
    if factor == 1.0 {
        return true;
    }
    matrix.row_mut(i).unscale_mut(factor);
    matrix.column_mut(i).scale_mut(factor);
    false
}

fn off_diagonal_sum<'a>(entries: impl Iterator<Item = &'a f64>, diagonal: usize) -> f64 {
    let others = entries.enumerate().filter(|(j, _)| *j != diagonal);
    others.fold(0.0, |sum, (_, x)| sum + x.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_response_of_the_matrices_is_that_of_the_section() {
        let biquad = Biquad::new([0.4, -0.3, 0.2], [2.0, -2.4, 0.9]);
        let cascade = StateSpace::gain(3.0)
            .then(&StateSpace::from(&biquad))
            .then(&StateSpace::from(&biquad));
        for angle in [0.01, 0.3, 1.2, 3.0] {
            let z = Complex::new(f64::cos(angle), f64::sin(angle));
            let expected = biquad.response(z) * biquad.response(z) * 3.0;
            assert!((cascade.response(z) - expected).norm() < 1e-12 * expected.norm());
        }
    }

    #[test]
    fn closed_poles_are_the_zeros_of_one_plus_the_response() {
        // 1 + D + b c/(z - a) is zero at z = a - b c/(1 + D): -1 - 6/1.5 = -5.
        let first = StateSpace::new(&[-1.0], &[2.0], &[3.0], 0.5);
        let poles = first.closed_poles().unwrap();
        assert!(poles.len() == 1 && (poles[0] + 5.0).norm() < 1e-14);
        // 1 + N/M is zero where N + M is: 2.4 z^2 - 2.7 z + 1.1.
        let second = StateSpace::from(&Biquad::new([0.4, -0.3, 0.2], [2.0, -2.4, 0.9]));
        let poles = second.closed_poles().unwrap();
        let [a, b] = poles.as_slice() else {
            panic!("{poles:?}");
        };
        // Rounding of a matrix of order 2.
        assert!((a + b - 2.7 / 2.4).norm() < 1e-14, "{poles:?}");
        assert!((a * b - 1.1 / 2.4).norm() < 1e-14, "{poles:?}");
    }
}
