//! A discrete second order section: immutable coefficients and a separate state.

use nalgebra::{Complex, Matrix2, RowVector2, Vector2};

use super::quadratic::quadratic_roots;

/// Coefficients of H(z) = (b0 + b1 z^-1 + b2 z^-2)/(1 + a1 z^-1 + a2 z^-2).
///
/// Both signs are those of the transfer function, as in Oppenheim and Schafer, *Discrete-Time Signal Processing*: the
/// feedback enters the difference equation with a minus sign.
///
/// ```text
///  y[k] = b0 x[k] + b1 x[k-1] + b2 x[k-2] - a1 y[k-1] - a2 y[k-2]
/// ```
///
/// Input and output may have any unit; the coefficients b have the unit of output over input, the coefficients a have none.
///
/// The response to a sine of frequency w is H(exp(j w T)). A first order low pass with a time constant of 9 samples:
///
/// ```
/// use bench_control::{Biquad, BiquadState};
///
/// let low_pass = Biquad::new([0.1, 0.0, 0.0], [1.0, -0.9, 0.0]);
/// let mut state = BiquadState::default();
/// let step: Vec<f64> = (0..50).map(|_| low_pass.update(&mut state, 1.0)).collect();
/// // The analytic step response is 1 - 0.9^(k + 1).
/// for (k, y) in (1..).zip(step) {
///     assert!((y - (1.0 - 0.9f64.powi(k))).abs() < 1e-14);
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Biquad {
    b: [f64; 3],
    a: [f64; 2],
}

/// The state of a section between two samples, in transposed direct form II. At rest by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BiquadState([f64; 2]);

impl Biquad {
    /// A section from coefficients by rising power of z^-1; all are divided by the first one of the denominator.
    pub fn new(numerator: [f64; 3], denominator: [f64; 3]) -> Self {
        let [a0, a1, a2] = denominator;
        Biquad {
            b: numerator.map(|c| c / a0),
            a: [a1 / a0, a2 / a0],
        }
    }

    /// The output for the input `x` of this sample. Runs in the tick: must not allocate or block.
    pub fn update(&self, state: &mut BiquadState, x: f64) -> f64 {
        let y = self.b[0] * x + state.0[0];
        state.0[0] = self.b[1] * x - self.a[0] * y + state.0[1];
        state.0[1] = self.b[2] * x - self.a[1] * y;
        y
    }

    /// H(z).
    pub fn response(&self, z: Complex<f64>) -> Complex<f64> {
        let w = z.inv();
        let numerator = (w * self.b[2] + self.b[1]) * w + self.b[0];
        numerator / ((w * self.a[1] + self.a[0]) * w + 1.0)
    }

    /// Zeros and poles in the z plane, without those at z = 0.
    pub fn roots(&self) -> Vec<Complex<f64>> {
        let [a1, a2] = self.a;
        let polynomials = [self.b, [1.0, a1, a2]];
        let roots = polynomials.into_iter().flat_map(roots_of);
        roots.filter(|root| root.norm() > 0.0).collect()
    }

    /// x+ = A x + B u, y = C x + D u, where x is the [`BiquadState`].
    pub fn state_space(&self) -> (Matrix2<f64>, Vector2<f64>, RowVector2<f64>, f64) {
        let [a1, a2] = self.a;
        let [b0, b1, b2] = self.b;
        (
            Matrix2::new(-a1, 1.0, -a2, 0.0),
            Vector2::new(b1 - a1 * b0, b2 - a2 * b0),
            RowVector2::new(1.0, 0.0),
            b0,
        )
    }
}

/// Roots of c0 z^2 + c1 z + c2; none of a constant.
fn roots_of([c0, c1, c2]: [f64; 3]) -> Vec<Complex<f64>> {
    match (c0, c1) {
        (0.0, 0.0) => Vec::new(),
        (0.0, _) => vec![Complex::new(-c2 / c1, 0.0)],
        _ => quadratic_roots(c0, c1, c2).to_vec(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [f64; 4] = [0.01, 0.3, 1.2, 3.0];
    const SECTION: [[f64; 3]; 2] = [[0.4, -0.3, 0.2], [2.0, -2.4, 0.9]];

    fn section() -> Biquad {
        let [numerator, denominator] = SECTION;
        Biquad::new(numerator, denominator)
    }

    fn outputs(biquad: &Biquad, input: impl Iterator<Item = f64>) -> Vec<f64> {
        let mut state = BiquadState::default();
        input.map(|x| biquad.update(&mut state, x)).collect()
    }

    #[test]
    fn update_matches_the_difference_equation() {
        let input: Vec<f64> = (0..50)
            .map(|k| f64::sin(k as f64) + 0.1 * k as f64)
            .collect();
        let output = outputs(&section(), input.iter().copied());
        for (k, &x) in input.iter().enumerate() {
            let back = |list: &[f64], n: usize| if k >= n { list[k - n] } else { 0.0 };
            let forward = 0.2 * x - 0.15 * back(&input, 1) + 0.1 * back(&input, 2);
            let direct = forward + 1.2 * back(&output, 1) - 0.45 * back(&output, 2);
            assert!(
                (output[k] - direct).abs() < 1e-13 * direct.abs().max(1.0),
                "sample {k}"
            );
        }
    }

    #[test]
    fn response_is_the_transform_of_the_impulse_response() {
        let impulse = std::iter::once(1.0).chain(std::iter::repeat_n(0.0, 399));
        let response = outputs(&section(), impulse);
        for angle in POINTS {
            let z = Complex::new(f64::cos(angle), f64::sin(angle));
            let sum: Complex<f64> = response
                .iter()
                .rev()
                .fold(Complex::new(0.0, 0.0), |sum, h| sum / z + h);
            // The poles have the magnitude sqrt(0.45): after 400 samples the response is 1e-69 of its beginning.
            assert!((sum - section().response(z)).norm() < 1e-12);
        }
    }

    #[test]
    fn state_space_has_the_same_response() {
        let (a, b, c, d) = section().state_space();
        for angle in POINTS {
            let z = Complex::new(f64::cos(angle), f64::sin(angle));
            let shifted = Matrix2::identity() * z - a.map(|x| Complex::new(x, 0.0));
            let resolvent = shifted.try_inverse().unwrap();
            let (b, c) = (b.map(Complex::from), c.map(Complex::from));
            let direct = (c * resolvent * b)[0] + d;
            assert!((direct - section().response(z)).norm() < 1e-13);
        }
    }
}
