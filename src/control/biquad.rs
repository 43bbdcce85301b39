//! A discrete section, H(z) = (b0 + b1 z^-1 + b2 z^-2)/(1 + a1 z^-1 + a2 z^-2).
//!
//! The signs are those of the transfer function:
//!
//! ```text
//!  y[k] = b0 x[k] + b1 x[k-1] + b2 x[k-2] - a1 y[k-1] - a2 y[k-2]
//! ```

use nalgebra::{Complex, Matrix2, RowVector2, Vector2};

/// A section in transposed direct form II, with its state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Biquad {
    b: [f64; 3],
    a: [f64; 2],
    state: [f64; 2],
}

impl Biquad {
    /// A section at rest from coefficients by rising power of z^-1, divided by the denominator's first.
    pub fn new(numerator: [f64; 3], denominator: [f64; 3]) -> Self {
        let b = numerator.map(|c| c / denominator[0]);
        Biquad {
            b,
            a: [
                denominator[1] / denominator[0],
                denominator[2] / denominator[0],
            ],
            state: [0.0; 2],
        }
    }

    /// The output for the input `x` of this tick. *In the tick.*
    pub fn update(&mut self, x: f64) -> f64 {
        let y = self.b[0] * x + self.state[0];
        self.state[0] = self.b[1] * x - self.a[0] * y + self.state[1];
        self.state[1] = self.b[2] * x - self.a[1] * y;
        y
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.state = [0.0; 2];
    }

    /// H(z).
    pub fn response(&self, z: Complex<f64>) -> Complex<f64> {
        let w = z.inv();
        let numerator = (w * self.b[2] + self.b[1]) * w + self.b[0];
        numerator / ((w * self.a[1] + self.a[0]) * w + 1.0)
    }

    /// x+ = A x + B u, y = C x + D u with the two states of [`Biquad::update`].
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

#[cfg(test)]
mod tests {
    use super::*;

    const POINTS: [f64; 4] = [0.01, 0.3, 1.2, 3.0];

    #[test]
    fn update_is_the_difference_equation_of_the_docstring() {
        let mut biquad = Biquad::new([0.4, -0.3, 0.2], [2.0, -2.4, 0.9]);
        let input: Vec<f64> = (0..50)
            .map(|k| f64::sin(k as f64) + 0.1 * k as f64)
            .collect();
        let mut output: Vec<f64> = Vec::new();
        for (k, &x) in input.iter().enumerate() {
            let back = |list: &[f64], n: usize| if k >= n { list[k - n] } else { 0.0 };
            let direct =
                0.2 * x - 0.15 * back(&input, 1) + 0.1 * back(&input, 2) + 1.2 * back(&output, 1)
                    - 0.45 * back(&output, 2);
            output.push(direct);
            assert!(
                (biquad.update(x) - direct).abs() < 1e-13 * direct.abs().max(1.0),
                "sample {k}"
            );
        }
    }

    #[test]
    fn the_response_is_the_transform_of_the_impulse_response() {
        let mut biquad = Biquad::new([0.4, -0.3, 0.2], [2.0, -2.4, 0.9]);
        let response: Vec<f64> = (0..400)
            .map(|k| biquad.update(if k == 0 { 1.0 } else { 0.0 }))
            .collect();
        for angle in POINTS {
            let z = Complex::new(f64::cos(angle), f64::sin(angle));
            let sum: Complex<f64> = response
                .iter()
                .rev()
                .fold(Complex::new(0.0, 0.0), |sum, h| sum / z + h);
            // The poles have magnitude sqrt(0.45): 400 samples leave nothing.
            assert!((sum - biquad.response(z)).norm() < 1e-12);
        }
    }

    #[test]
    fn the_state_space_has_the_same_response() {
        let biquad = Biquad::new([0.4, -0.3, 0.2], [2.0, -2.4, 0.9]);
        let (a, b, c, d) = biquad.state_space();
        for angle in POINTS {
            let z = Complex::new(f64::cos(angle), f64::sin(angle));
            let resolvent = (Matrix2::identity() * z - a.map(|x| Complex::new(x, 0.0)))
                .try_inverse()
                .unwrap();
            let direct =
                (c.map(|x| Complex::new(x, 0.0)) * resolvent * b.map(|x| Complex::new(x, 0.0)))[0]
                    + d;
            assert!((direct - biquad.response(z)).norm() < 1e-13);
        }
    }
}
