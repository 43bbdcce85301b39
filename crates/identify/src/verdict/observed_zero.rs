//! The zeros of complex residues, as the response shows them.
//!
//! Zeros are computed from the numerators r + q s of the modes and R. Through samples, complex residues and R also represent what is no sum of
//! modes, as a filter between input and output or a delay of a period, and describe the response to its noise with other zeros than it has.
//! So the zero of the fitted response itself is found, as the data show it:
//!
//! ```text
//! N(s) = H(s) prod (s^2 + 2 zeta_k w_k s + w_k^2)        smooth around s = j w_0; the polynomial through some points on the axis is continued
//! ```
//!
//! The difference of the two counts as an error of the zero, with the weight of a standard deviation.

use nalgebra::Complex;

use super::zeros::UncertainZero;
use crate::modal::{MeasurementChain, ModalFit};

/// Number of points of the polynomial.
const POINTS: usize = 7;
/// Half of the width of the points, as a multiple of the distance of the zero from the axis ...
const WIDTH: f64 = 2.0;
/// ... and at least this part of its frequency.
const MIN_WIDTH: f64 = 0.01;
/// A zero whose distance from the axis exceeds this part of its frequency is certain enough.
const MAX_DISTANCE: f64 = 0.1;
/// Number of Newton steps.
const STEPS: usize = 30;
/// A root farther than this multiple of the half width is none of the zero.
const MAX_PLACE: f64 = 3.0;

/// The zero where the response of the fit has it, with the difference added to its errors. A zero that the response does not have there may
/// lie on either side of the axis.
pub(super) fn as_observed(
    zero: UncertainZero,
    fit: &ModalFit,
    chain: &MeasurementChain,
) -> UncertainZero {
    let (center, distance) = (zero.s.im, zero.s.re.abs());
    if center <= 0.0 || distance > MAX_DISTANCE * center {
        return zero;
    }
    let half = (WIDTH * distance).max(MIN_WIDTH * center);
    let nearby = Neighbourhood { center, half };
    let numerator = Polynomial::through(&nearby.numerator(fit, chain));
    match numerator.root_near(nearby.place(zero.s)) {
        Some(root) => zero.moved_to(nearby.s(root)),
        None => zero.moved_to(Complex::new(-zero.s.re, center)),
    }
}

/// s = j (center + half x).
struct Neighbourhood {
    center: f64,
    half: f64,
}

impl Neighbourhood {
    fn s(&self, place: Complex<f64>) -> Complex<f64> {
        (place * self.half + self.center) * Complex::i()
    }

    fn place(&self, s: Complex<f64>) -> Complex<f64> {
        (s / Complex::i() - self.center) / self.half
    }

    /// N at the points, as pairs of place and value. The squares of all frequencies are divided by that of the center.
    fn numerator(&self, fit: &ModalFit, chain: &MeasurementChain) -> Vec<(f64, Complex<f64>)> {
        let places = points();
        let omega = places.map(|place| self.center + self.half * place);
        let frequency_hz = omega.map(|omega| omega / std::f64::consts::TAU);
        let response = fit.response(chain, &frequency_hz);
        let values = response.iter().zip(omega).map(|(response, omega)| {
            let s = Complex::new(0.0, omega / self.center);
            let denominators = fit.parameters.modes.iter().map(|mode| {
                let w = mode.omega_rad_s / self.center;
                s * s + s * (2.0 * mode.damping_ratio * w) + w * w
            });
            response * denominators.product::<Complex<f64>>()
        });
        places.into_iter().zip(values).collect()
    }
}

/// Chebyshev points from -1 to 1.
fn points() -> [f64; POINTS] {
    std::array::from_fn(|k| (std::f64::consts::PI * (k as f64 + 0.5) / POINTS as f64).cos())
}

/// A polynomial in the form of Newton: c_0 + (x - x_0) (c_1 + (x - x_1) (c_2 + ...)).
struct Polynomial {
    places: Vec<f64>,
    coefficients: Vec<Complex<f64>>,
}

impl Polynomial {
    /// By divided differences.
    fn through(points: &[(f64, Complex<f64>)]) -> Polynomial {
        let places: Vec<f64> = points.iter().map(|(place, _)| *place).collect();
        let mut coefficients: Vec<Complex<f64>> = points.iter().map(|(_, value)| *value).collect();
        for order in 1..places.len() {
            for k in (order..places.len()).rev() {
                coefficients[k] =
                    (coefficients[k] - coefficients[k - 1]) / (places[k] - places[k - order]);
            }
        }
        Polynomial {
            places,
            coefficients,
        }
    }

    /// The value and the derivative.
    fn at(&self, x: Complex<f64>) -> [Complex<f64>; 2] {
        let zero = Complex::new(0.0, 0.0);
        let terms = self.coefficients.iter().zip(&self.places).rev();
        terms.fold([zero, zero], |[value, slope], (coefficient, place)| {
            [
                value * (x - place) + coefficient,
                slope * (x - place) + value,
            ]
        })
    }

    /// The root that Newton's method finds from a start, if it is near the points.
    fn root_near(&self, start: Complex<f64>) -> Option<Complex<f64>> {
        let mut x = start;
        let mut step = Complex::new(f64::INFINITY, 0.0);
        for _ in 0..STEPS {
            let [value, slope] = self.at(x);
            step = value / slope;
            x -= step;
        }
        let is_root = step.norm() < 1e-6 && x.norm() < MAX_PLACE;
        is_root.then_some(x)
    }
}
