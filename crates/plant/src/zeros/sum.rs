//! A transfer function as the sum of its modes and optionally a constant:
//! G(s) = R + sum of r_i/(s^2 + 2 zeta_i w_i s + w_i^2) (Eqs. 3-2, 3-6, 3-10, 3-11 with beta = 0).
//!
//! A mode of w = 0 is a double integrator r/s^2. The constant represents a mode far above all others.
//!
//! With damping that is not proportional the residues are complex: the numerators are r_i + q_i s, with the rates q_i in s/kg.

use nalgebra::{Complex, DMatrix, DVector};

use super::Zero;
use super::kinds::{self, System};
use super::rational;
use super::term::ModalTerm;
use crate::{ModalModel, PlantError, Sign};

/// The sum, lowest frequency first.
///
/// ```
/// use bench_plant::zeros::{ModalSum, ModalTerm, ZeroCounts};
///
/// // Eq. (3-9) with a0 = 5: two close modes of opposite signs beside a double integrator.
/// let terms = [(0.0, 1.0), (10.0, -5.0), (11.0, 5.0)];
/// let terms = terms.map(|(omega, residue)| ModalTerm::undamped(omega, residue));
/// let sum = ModalSum::new(terms.to_vec(), 0.0)?;
/// assert_eq!(ZeroCounts::of(&sum.undamped_zeros()?).to_string(), "CMP-CNMP");
/// # Ok::<(), bench_plant::PlantError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ModalSum {
    terms: Vec<ModalTerm>,
    /// q of each term in s/kg; empty if all residues are real.
    rates_s_per_kg: Vec<f64>,
    constant_m_per_n: f64,
}

impl ModalSum {
    /// A sum of modes in any order. Refuses one whose residues and constant are all zero.
    pub fn new(mut terms: Vec<ModalTerm>, constant_m_per_n: f64) -> Result<ModalSum, PlantError> {
        terms.retain(|term| term.residue_per_kg != 0.0);
        terms.sort_by(|a, b| a.omega_rad_s.total_cmp(&b.omega_rad_s));
        if terms.is_empty() && constant_m_per_n == 0.0 {
            return Err(PlantError::NoResponse);
        }
        Ok(ModalSum {
            terms,
            rates_s_per_kg: Vec::new(),
            constant_m_per_n,
        })
    }

    /// A sum of modes with complex residues, in any order, each with its rate q in s/kg:
    ///
    /// ```text
    /// G(s) = R + sum of (r_i + q_i s)/(s^2 + 2 zeta_i w_i s + w_i^2)
    /// ```
    ///
    /// # Errors
    /// When all residues, all rates and the constant are zero.
    ///
    /// ```
    /// use bench_plant::zeros::{ModalSum, ModalTerm};
    ///
    /// // (3 + s)/(s^2 + 4) has one zero, at s = -3.
    /// let mode = ModalTerm::undamped(2.0, 3.0);
    /// let zeros = ModalSum::with_rates(vec![(mode, 1.0)], 0.0)?.damped_zeros()?;
    /// assert!(zeros.len() == 1 && (zeros[0].s.re + 3.0).abs() < 1e-14 && zeros[0].s.im == 0.0);
    /// # Ok::<(), bench_plant::PlantError>(())
    /// ```
    pub fn with_rates(
        mut terms: Vec<(ModalTerm, f64)>,
        constant_m_per_n: f64,
    ) -> Result<ModalSum, PlantError> {
        terms.retain(|(term, rate)| term.residue_per_kg != 0.0 || *rate != 0.0);
        terms.sort_by(|(a, _), (b, _)| a.omega_rad_s.total_cmp(&b.omega_rad_s));
        if terms.is_empty() && constant_m_per_n == 0.0 {
            return Err(PlantError::NoResponse);
        }
        let (terms, rates_s_per_kg) = terms.into_iter().unzip();
        Ok(ModalSum {
            terms,
            rates_s_per_kg,
            constant_m_per_n,
        })
    }

    /// The modes of a structure that can be observed between its actuator and its probe ([`ModalModel::signs`]).
    pub fn visible(modal: &ModalModel) -> Result<ModalSum, PlantError> {
        let modes = modal.modes.iter().zip(modal.signs());
        let visible = modes.filter(|(_, sign)| *sign != Sign::Hidden);
        let terms = visible.map(|(mode, _)| ModalTerm::from(mode));
        ModalSum::new(terms.collect(), 0.0)
    }

    /// The modes with a residue, lowest frequency first.
    pub fn terms(&self) -> &[ModalTerm] {
        &self.terms
    }

    /// R in m/N.
    pub fn constant_m_per_n(&self) -> f64 {
        self.constant_m_per_n
    }

    /// Whether there is a constant R.
    pub fn has_constant(&self) -> bool {
        self.constant_m_per_n != 0.0
    }

    /// Whether the slowest mode is a double integrator.
    pub fn is_free(&self) -> bool {
        self.terms
            .first()
            .is_some_and(|term| term.omega_rad_s == 0.0)
    }

    /// G(s) in m/N.
    pub fn response(&self, s: Complex<f64>) -> Complex<f64> {
        let parts = self
            .terms
            .iter()
            .map(|term| term.resonance(s) * term.residue_per_kg);
        let rates = self.terms.iter().zip(&self.rates_s_per_kg);
        let rates = rates.map(|(term, rate)| term.resonance(s) * s * *rate);
        parts.chain(rates).sum::<Complex<f64>>() + self.constant_m_per_n
    }

    /// Zeros without damping, and without the rates, which damping causes, lowest frequency first.
    pub fn undamped_zeros(&self) -> Result<Vec<Zero>, PlantError> {
        self.zeros_by(kinds::undamped)
    }

    /// Zeros with damping, lowest frequency first.
    pub fn damped_zeros(&self) -> Result<Vec<Zero>, PlantError> {
        if self.rates_s_per_kg.iter().all(|rate| *rate == 0.0) {
            return self.zeros_by(kinds::damped);
        }
        let undamped = self.undamped_zeros()?;
        let terms: Vec<(ModalTerm, f64)> = self.terms.iter().copied().zip(self.rates()).collect();
        let zeros = rational::zeros(&terms, self.constant_m_per_n)?;
        let zeros = zeros.into_iter().map(|s| kinds::damped_zero(s, &undamped));
        Ok(kinds::sorted(zeros.collect()))
    }

    fn rates(&self) -> impl Iterator<Item = f64> {
        self.rates_s_per_kg.iter().copied()
    }

    /// Computes the zeros of an equivalent system: one unit mass on a spring per mode, with sqrt(|residue|) as force
    /// and sensor gain and the sign of the residue on the force gain, plus the constant.
    fn zeros_by(
        &self,
        zeros: fn(&System) -> Result<Vec<Zero>, PlantError>,
    ) -> Result<Vec<Zero>, PlantError> {
        let n = self.terms.len();
        if n == 0 {
            return Ok(Vec::new());
        }
        zeros(&System {
            mass: &DMatrix::identity(n, n),
            damping: &self.diagonal(|term| 2.0 * term.damping_ratio * term.omega_rad_s),
            stiffness: &self.diagonal(|term| term.omega_rad_s * term.omega_rad_s),
            force: &self.vector(|term| root(term).copysign(term.residue_per_kg)),
            sensor: &self.vector(root),
            constant_m_per_n: self.constant_m_per_n,
        })
    }

    fn vector(&self, of: fn(&ModalTerm) -> f64) -> DVector<f64> {
        DVector::from_iterator(self.terms.len(), self.terms.iter().map(of))
    }

    fn diagonal(&self, of: fn(&ModalTerm) -> f64) -> DMatrix<f64> {
        DMatrix::from_diagonal(&self.vector(of))
    }
}

/// The square root of the magnitude of a residue.
fn root(term: &ModalTerm) -> f64 {
    term.residue_per_kg.abs().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_beside_a_constant_match_the_closed_form() {
        // r/(u + w^2) + R = 0 at u = -w^2 - r/R: on the imaginary axis for r/R > -w^2, real below.
        for (residue, constant) in [(2.0, 0.5), (-3.0, 0.5), (1.0, 1e-9), (1e-9, -1.0)] {
            let sum = ModalSum::new(vec![ModalTerm::undamped(2.0, residue)], constant).unwrap();
            let u = -4.0 - residue / constant;
            let zeros = sum.undamped_zeros().unwrap();
            assert_eq!(zeros.len(), 2);
            for zero in zeros {
                // A pencil of one row: some rounding, of the sum of the two as well.
                let tolerance = 1e-14 * (u.abs() + 4.0);
                assert!((zero.s * zero.s - u).norm() < tolerance, "{zero:?} for {u}");
            }
        }
    }

    #[test]
    fn rejects_a_sum_without_residues() {
        assert_eq!(
            ModalSum::new(vec![ModalTerm::undamped(1.0, 0.0)], 0.0),
            Err(PlantError::NoResponse)
        );
    }
}
