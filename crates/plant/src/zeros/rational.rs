//! Zeros of a sum of modes with complex residues, from a pencil of its state space.
//!
//! ```text
//! G(s) = R + sum of (r + q s)/(s^2 + 2 zeta w s + w^2)
//! ```
//!
//! Each mode has the states x and x'/w: with its gains g at the input and c at the output,
//!
//! ```text
//! d/dt [x, x'/w] = [[0, w], [-w, -2 zeta w]] [x, x'/w] + [0, g] u,   y = c . [x, x'/w],   c = [r/(w g), q/g]
//! ```
//!
//! A zero is an s for which some motion x != 0 with an input u has no output, c . x + R u = 0, and (A - s I) x + b u = 0. With an
//! orthonormal basis [N; f] of the vectors [x; u] orthogonal to [c; R]:
//!
//! ```text
//! (A N + b f) v = s N v
//! ```
//!
//! (A. Emami-Naeini, P. Van Dooren, Automatica 18 (1982) 415, for one input and one output.) Input and output gains of a mode have the
//! same size, and time has the unit of a period between those of the modes, so that all entries have similar magnitudes.

use nalgebra::{Complex, DMatrix, DVector};

use super::term::ModalTerm;
use crate::PlantError;
use crate::linear_algebra::{orthogonal_complement, pencil_roots};

/// The zeros in rad/s, in no order, of modes with their rates q in s/kg and a constant in m/N.
///
/// # Errors
/// When the eigenvalue iteration does not end.
pub(super) fn zeros(
    terms: &[(ModalTerm, f64)],
    constant_m_per_n: f64,
) -> Result<Vec<Complex<f64>>, PlantError> {
    if terms.is_empty() {
        return Ok(Vec::new());
    }
    let scale_rad_s = frequency_scale_rad_s(terms);
    let [constant, linear] = StateSpace::new(terms, scale_rad_s).pencil(constant_m_per_n);
    let roots = pencil_roots(&constant, &linear)?;
    Ok(roots.into_iter().map(|root| root * scale_rad_s).collect())
}

/// The fourth root of the mean of w^4; 1 rad/s if all modes are double integrators.
fn frequency_scale_rad_s(terms: &[(ModalTerm, f64)]) -> f64 {
    let powers = terms.iter().map(|(term, _)| term.omega_rad_s.powi(4));
    let mean = powers.sum::<f64>() / terms.len() as f64;
    if mean > 0.0 { mean.powf(0.25) } else { 1.0 }
}

/// The state space of modes, with time in units of 1/scale.
struct StateSpace {
    system: DMatrix<f64>,
    input: DVector<f64>,
    output: DVector<f64>,
}

impl StateSpace {
    fn new(terms: &[(ModalTerm, f64)], scale_rad_s: f64) -> StateSpace {
        let states = 2 * terms.len();
        let mut space = StateSpace {
            system: DMatrix::zeros(states, states),
            input: DVector::zeros(states),
            output: DVector::zeros(states),
        };
        for (k, (term, rate_s_per_kg)) in terms.iter().enumerate() {
            space.set_mode(2 * k, term, *rate_s_per_kg, scale_rad_s);
        }
        space
    }

    /// The states of a mode, from index `first` on.
    fn set_mode(&mut self, first: usize, term: &ModalTerm, rate_s_per_kg: f64, scale_rad_s: f64) {
        let w = term.omega_rad_s / scale_rad_s;
        // A double integrator has the states x and x'.
        let state_scale = if w > 0.0 { w } else { 1.0 };
        let by_position = term.residue_per_kg / (state_scale * scale_rad_s * scale_rad_s);
        let by_velocity = rate_s_per_kg / scale_rad_s;
        let gain = by_position.hypot(by_velocity).sqrt();
        self.system[(first, first + 1)] = state_scale;
        self.system[(first + 1, first)] = -w * w / state_scale;
        self.system[(first + 1, first + 1)] = -2.0 * term.damping_ratio * w;
        self.input[first + 1] = gain;
        self.output[first] = by_position / gain;
        self.output[first + 1] = by_velocity / gain;
    }

    /// A N + b f and -N: the pencil P + s L whose roots are the zeros, with input and output scaled to unit gains.
    fn pencil(&self, constant_m_per_n: f64) -> [DMatrix<f64>; 2] {
        let states = self.input.len();
        let (input, output) = (self.input.norm(), self.output.norm());
        let through = constant_m_per_n / (input * output);
        let basis = orthogonal_complement(&(&self.output / output).push(through));
        let (motions, forces) = (basis.rows(0, states), basis.row(states));
        let constant = &self.system * motions + (&self.input / input) * forces;
        [constant, -motions.into_owned()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::zeros::{ModalSum, ZeroKind};

    fn term(omega_rad_s: f64, damping_ratio: f64, residue_per_kg: f64) -> ModalTerm {
        ModalTerm {
            omega_rad_s,
            damping_ratio,
            residue_per_kg,
        }
    }

    /// Each of the expected numbers is found within a tolerance, and no other.
    fn assert_zeros(mut found: Vec<Complex<f64>>, expected: &[Complex<f64>], tolerance: f64) {
        assert_eq!(found.len(), expected.len(), "{found:?}");
        for zero in expected {
            let distances = found.iter().map(|s| (s - zero).norm()).enumerate();
            let nearest = distances.min_by(|a, b| a.1.total_cmp(&b.1));
            let (index, distance) = nearest.expect("as many zeros as expected");
            assert!(distance < tolerance, "{zero}: {found:?}");
            found.swap_remove(index);
        }
    }

    /// R + (r + q s)/(s^2 + 2 zeta w s + w^2) = 0 at the roots of s^2 + (2 zeta w + q/R) s + w^2 + r/R.
    #[test]
    fn zeros_of_one_mode_beside_a_constant_are_those_of_a_quadratic() {
        for (r, q, constant) in [(2.0, 0.3, 0.5), (-3.0, -0.2, 0.5), (2.0, -7.0, 1.0)] {
            let (w, zeta) = (2.0, 0.05);
            let half = 0.5 * (2.0 * zeta * w + q / constant);
            let square = w * w + r / constant;
            let root = Complex::new(half * half - square, 0.0).sqrt();
            let expected = [-half + root, -half - root];
            let found = zeros(&[(term(w, zeta, r), q)], constant).unwrap();
            // Numbers of up to 10, rounded some ten times.
            assert_zeros(found, &expected, 1e-13);
        }
    }

    /// The product of (s - z)(s - z*) over those of the poles as partial fractions: with the pole p of a mode and the residue
    /// rho = lim (s - p) G, the numerator is r + q s = rho (s - p*) + conj.
    #[test]
    fn zeros_of_partial_fractions_are_those_of_the_product() {
        let poles = [(180.0, 0.01), (195.0, 0.05), (420.0, 0.002)];
        let poles =
            poles.map(|(w, zeta)| Complex::new(-zeta * w, w * (1.0_f64 - zeta * zeta).sqrt()));
        for (re, im) in [(0.5, 189.7), (-3.0, 188.0), (12.0, 300.0)] {
            let pair = [Complex::new(re, im), Complex::new(-20.0, 350.0)];
            let expected = [pair[0], pair[0].conj(), pair[1], pair[1].conj()];
            let residue = |k: usize| {
                let p = poles[k];
                let numerator: Complex<f64> = expected.iter().map(|z| p - z).product();
                let others = (0..poles.len()).filter(|j| *j != k);
                let others: Complex<f64> = others
                    .map(|j| (p - poles[j]) * (p - poles[j].conj()))
                    .product();
                numerator / (others * (p - p.conj()))
            };
            let terms: Vec<(ModalTerm, f64)> = (0..poles.len())
                .map(|k| {
                    let (p, rho) = (poles[k], residue(k));
                    let r = -2.0 * (rho * p.conj()).re;
                    (term(p.norm(), -p.re / p.norm(), r), 2.0 * rho.re)
                })
                .collect();
            let found = zeros(&terms, 0.0).unwrap();
            // The sum of the rates is zero up to rounding, so that two more zeros lie far away.
            let near = found.into_iter().filter(|s| s.norm() < 1e5);
            // Residues of differences of 1e-2 of the frequencies, rounded: some hundred roundings of 400 rad/s.
            assert_zeros(near.collect(), &expected, 1e-8);
        }
    }

    #[test]
    fn small_rates_move_the_zeros_of_real_residues_by_little() {
        let terms = [
            term(180.0, 0.01, 0.5),
            term(200.0, 0.01, -0.3),
            term(300.0, 0.01, 0.4),
        ];
        let real = ModalSum::new(terms.to_vec(), 1e-7)
            .unwrap()
            .damped_zeros()
            .unwrap();
        let rates = terms.map(|term| (term, 1e-13));
        let complex = ModalSum::with_rates(rates.to_vec(), 1e-7)
            .unwrap()
            .damped_zeros()
            .unwrap();
        assert_eq!(real.len(), complex.len());
        for (real, complex) in real.iter().zip(&complex) {
            // Of the rates: 1e-13 x 300 over 0.1, of zeros of up to 3000 rad/s.
            assert!((real.s - complex.s).norm() < 1e-5, "{real:?} {complex:?}");
            assert_eq!(real.kind, complex.kind);
        }
        assert!(complex.iter().any(|zero| zero.kind == ZeroKind::Cnmp));
    }

    #[test]
    fn a_double_integrator_with_a_rate_has_a_real_zero() {
        // (2 + 4 s)/s^2.
        assert_zeros(
            zeros(&[(term(0.0, 0.0, 2.0), 4.0)], 0.0).unwrap(),
            &[Complex::new(-0.5, 0.0)],
            1e-14,
        );
    }
}
