//! A stage of three modes that one damper couples.
//!
//! ```text
//! M = I,   C = diag(2 zeta w_k) + d g g^T,   K = diag(w_k^2)           G(s) = c^T (s^2 M + s C + K)^-1 b
//! ```
//!
//! Its numerator and its denominator are the determinants of polynomials
//!
//! ```text
//! N(s) = -det [[s^2 M + s C + K, b], [c^T, 0]],   D(s) = det (s^2 M + s C + K)
//! ```
//!
//! and their roots are eigenvalues of companion matrices. With the unit of time 1/SCALE the coefficients have similar sizes.

use nalgebra::{Complex, DMatrix, DVector};
use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use crate::FrfDatum;

/// A stage: frequencies in hertz, gains of force and probe in unit modal mass, and the damper d g g^T.
#[derive(Clone, Copy, Debug)]
pub(super) struct Stage {
    pub(super) hz: [f64; 3],
    pub(super) force: [f64; 3],
    pub(super) probe: [f64; 3],
    /// d in kg/s per unit modal mass, in rad/s.
    pub(super) damper_rad_s: f64,
    pub(super) place: [f64; 3],
}

/// Of each mode without the damper.
const DAMPING_RATIO: f64 = 0.004;
/// E|error|^2 over the square of the static response.
const NOISE: f64 = 1e-7;
const SCALE: f64 = 300.0;

/// A close pair of opposite residues on the response of a lower mode: zeros at 14.8 +- 615.4j and -26.7 +- 608.8j rad/s.
pub(super) const CNMP: Stage = Stage {
    hz: [20.0, 96.0, 99.0],
    force: [1.0, 0.45, 0.2],
    probe: [1.0, -0.2, 0.45],
    damper_rad_s: 20.0,
    place: [0.3, 0.8, 0.5],
};

/// Residues of equal signs: zeros at -6.9 +- 341.4j and -0.87 +- 400.0j rad/s.
pub(super) const CMP: Stage = Stage {
    hz: [25.0, 60.0, 66.0],
    force: [1.0, 0.6, 0.3],
    probe: [1.0, 0.3, 0.7],
    damper_rad_s: 20.0,
    place: [0.4, 0.7, 0.9],
};

/// Coefficients of a polynomial, that of the power 0 first.
type Polynomial = Vec<f64>;

impl Stage {
    /// The same stage with proportional damping.
    pub(super) fn without_damper(self) -> Stage {
        Stage {
            damper_rad_s: 0.0,
            ..self
        }
    }

    fn omega(&self, k: usize) -> f64 {
        std::f64::consts::TAU * self.hz[k]
    }

    /// Entry of C.
    fn damping(&self, i: usize, j: usize) -> f64 {
        let own = if i == j {
            2.0 * DAMPING_RATIO * self.omega(i)
        } else {
            0.0
        };
        own + self.damper_rad_s * self.place[i] * self.place[j]
    }

    /// G(s), by the inverse of the matrix.
    pub(super) fn response(&self, s: Complex<f64>) -> Complex<f64> {
        let impedance = DMatrix::from_fn(3, 3, |i, j| {
            let undamped = if i == j {
                s * s + self.omega(i).powi(2)
            } else {
                Complex::new(0.0, 0.0)
            };
            undamped + s * self.damping(i, j)
        });
        let inverse = impedance.try_inverse().expect("no pole");
        let vector = |gains: [f64; 3]| DVector::from_iterator(3, gains.map(Complex::from));
        (vector(self.probe).transpose() * inverse * vector(self.force))[(0, 0)]
    }

    /// The response with noise of a known variance.
    pub(super) fn data(&self, low_hz: f64, step_hz: f64, count: usize, seed: u64) -> Vec<FrfDatum> {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let variance = NOISE * self.response(Complex::new(0.0, 0.0)).norm_sqr();
        let datum = |k: usize| {
            let frequency_hz = low_hz + step_hz * k as f64;
            let s = Complex::new(0.0, std::f64::consts::TAU * frequency_hz);
            FrfDatum {
                frequency_hz,
                spread_hz: 0.0,
                response: self.response(s) + normal(&mut random) * variance.sqrt(),
                variance,
            }
        };
        (0..count).map(datum).collect()
    }

    /// Real noise with a standard deviation.
    pub(super) fn white_noise(count: usize, sigma: f64, seed: u64) -> Vec<f64> {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let sample = |_| normal(&mut random).re * sigma * std::f64::consts::SQRT_2;
        (0..count).map(sample).collect()
    }

    /// s^2 M + s C + K, bordered by b and c^T, in units of time of 1/SCALE.
    fn bordered(&self) -> Vec<Vec<Polynomial>> {
        let mut rows = Vec::new();
        for i in 0..3 {
            let mut row: Vec<Polynomial> = (0..3)
                .map(|j| {
                    let damping = self.damping(i, j) / SCALE;
                    if i == j {
                        vec![(self.omega(i) / SCALE).powi(2), damping, 1.0]
                    } else {
                        vec![0.0, damping]
                    }
                })
                .collect();
            row.push(vec![self.force[i]]);
            rows.push(row);
        }
        let mut last: Vec<Polynomial> = self.probe.iter().map(|gain| vec![*gain]).collect();
        last.push(vec![0.0]);
        rows.push(last);
        rows
    }

    /// N(s) and D(s).
    fn fraction(&self) -> (Polynomial, Polynomial) {
        let bordered = self.bordered();
        let impedance: Vec<Vec<Polynomial>> =
            bordered[..3].iter().map(|row| row[..3].to_vec()).collect();
        let numerator = determinant(&bordered).iter().map(|x| -x).collect();
        (numerator, determinant(&impedance))
    }

    /// The zeros in rad/s: of each pair the one above the real axis.
    pub(super) fn zeros(&self) -> Vec<Complex<f64>> {
        above_the_axis(&self.fraction().0)
    }

    /// Each pole p above the real axis in rad/s, lowest first, with its rho: G = sum of rho/(s - p) + conjugate, rho = N(p)/D'(p).
    pub(super) fn partial_fractions(&self) -> Vec<(Complex<f64>, Complex<f64>)> {
        let (numerator, denominator) = self.fraction();
        let slope: Polynomial = (1..denominator.len())
            .map(|k| k as f64 * denominator[k])
            .collect();
        let mut poles = above_the_axis(&denominator);
        poles.sort_by(|a, b| a.norm().total_cmp(&b.norm()));
        let with_rho = poles.into_iter().map(|pole| {
            let p = pole / SCALE;
            // One unit of time of N/D', which has s^-1: 1/SCALE.
            (pole, value(&numerator, p) / value(&slope, p) / SCALE)
        });
        with_rho.collect()
    }
}

/// A complex Gaussian number with E|z|^2 = 1.
fn normal(random: &mut Pcg64Mcg) -> Complex<f64> {
    let mut uniform = || (random.next_u64() as f64 + 0.5) / u64::MAX as f64;
    let (radius, angle) = ((-uniform().ln()).sqrt(), std::f64::consts::TAU * uniform());
    Complex::from_polar(radius, angle)
}

fn value(polynomial: &[f64], s: Complex<f64>) -> Complex<f64> {
    let coefficients = polynomial.iter().rev();
    coefficients.fold(Complex::new(0.0, 0.0), |sum, c| sum * s + *c)
}

fn add_product(sum: &mut Polynomial, sign: f64, a: &[f64], b: &[f64]) {
    sum.resize(sum.len().max(a.len() + b.len() - 1), 0.0);
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            sum[i + j] += sign * a * b;
        }
    }
}

/// By Laplace's expansion of the first row.
fn determinant(rows: &[Vec<Polynomial>]) -> Polynomial {
    let [first, others @ ..] = rows else {
        return vec![1.0];
    };
    let mut sum = vec![0.0];
    let mut sign = 1.0;
    for (column, entry) in first.iter().enumerate() {
        let minor: Vec<Vec<Polynomial>> = others
            .iter()
            .map(|row| [&row[..column], &row[column + 1..]].concat())
            .collect();
        add_product(&mut sum, sign, entry, &determinant(&minor));
        sign = -sign;
    }
    sum
}

/// The roots, in rad/s, that are not below the real axis: eigenvalues of the companion matrix.
fn above_the_axis(polynomial: &[f64]) -> Vec<Complex<f64>> {
    let largest = polynomial.iter().fold(0.0_f64, |size, c| size.max(c.abs()));
    let degree = polynomial
        .iter()
        .rposition(|c| c.abs() > 1e-12 * largest)
        .expect("a polynomial that is not zero");
    let companion = DMatrix::from_fn(degree, degree, |i, j| {
        if i + 1 == degree {
            -polynomial[j] / polynomial[degree]
        } else if j == i + 1 {
            1.0
        } else {
            0.0
        }
    });
    let roots = companion.complex_eigenvalues();
    let above = roots.iter().filter(|root| root.im >= 0.0);
    above.map(|root| root * SCALE).collect()
}
