//! One mode of a transfer function.

use nalgebra::Complex;

use crate::Mode;

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
