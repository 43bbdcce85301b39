//! A transfer function as the sum of its modes and optionally a constant:
//! G(s) = R + sum of r_i/(s^2 + 2 zeta_i w_i s + w_i^2) (Eqs. 3-2, 3-6, 3-10, 3-11 with beta = 0).
//!
//! A mode of w = 0 is a double integrator r/s^2. The constant represents a mode far above all others.

use nalgebra::{Complex, DMatrix, DVector};

use super::Zero;
use super::kinds::{self, System};
use crate::{ModalModel, Mode, PlantError, Sign};

/// One mode by frequency, damping and residue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ModalTerm {
    /// Undamped natural frequency in rad/s; 0 for a double integrator.
    pub omega_rad_s: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Residue in 1/kg.
    pub residue_per_kg: f64,
}

impl ModalTerm {
    /// A mode without damping.
    pub fn undamped(omega_rad_s: f64, residue_per_kg: f64) -> ModalTerm {
        ModalTerm {
            omega_rad_s,
            damping_ratio: 0.0,
            residue_per_kg,
        }
    }

    /// 1/(s^2 + 2 zeta w s + w^2) in s^2.
    pub fn resonance(&self, s: Complex<f64>) -> Complex<f64> {
        let (w, zeta) = (self.omega_rad_s, self.damping_ratio);
        (s * s + s * (2.0 * zeta * w) + w * w).inv()
    }

    /// Its contribution to the undamped G at s = j `omega_rad_s`, in m/N.
    pub fn part(&self, omega_rad_s: f64) -> f64 {
        let (w, omega) = (self.omega_rad_s, omega_rad_s);
        self.residue_per_kg / ((w - omega) * (w + omega))
    }
}

impl From<&Mode> for ModalTerm {
    fn from(mode: &Mode) -> ModalTerm {
        ModalTerm {
            omega_rad_s: mode.omega_rad_s,
            damping_ratio: mode.damping_ratio,
            residue_per_kg: mode.residue_per_kg(),
        }
    }
}

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
        parts.sum::<Complex<f64>>() + self.constant_m_per_n
    }

    /// Zeros without damping, lowest frequency first.
    pub fn undamped_zeros(&self) -> Result<Vec<Zero>, PlantError> {
        self.zeros_by(kinds::undamped)
    }

    /// Zeros with damping, lowest frequency first.
    pub fn damped_zeros(&self) -> Result<Vec<Zero>, PlantError> {
        self.zeros_by(kinds::damped)
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
