//! Zeros of a fit, each with its covariance.
//!
//! ```text
//! G(z) = R + sum of r q,   q = 1/(z^2 + 2 zeta w z + w^2)           dz = - (dG/dtheta . dtheta) / (dG/dz)
//! ```
//!
//! so that with the rows Re and Im of -(dG/dtheta)/(dG/dz) the covariance of (Re z, Im z) is J cov(theta) J^T. Where two zeros
//! meet, dG/dz is zero and the covariance grows without bound: then nothing is said of them.

use nalgebra::{Complex, DMatrix};

use crate::identify::modal::{Entry, Estimate, ModalFit};
use crate::model::plant::PlantError;
use crate::model::zeros::{ModalSum, ModalTerm, ZeroKind};

/// A zero with its errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncertainZero {
    /// Where it is, in rad/s; of a conjugate pair the one above the real axis.
    pub s: Complex<f64>,
    /// Covariance of its real and imaginary part in (rad/s)^2.
    pub covariance: [[f64; 2]; 2],
    /// Probability that it lies in the right half plane, for errors of a normal distribution.
    pub rhp_probability: f64,
    /// Its kind, where it is.
    pub kind: ZeroKind,
}

/// The zeros of a fit with damping, slowest first.
pub fn zeros(fit: &ModalFit) -> Result<Vec<UncertainZero>, PlantError> {
    let sum = ModalSum::new(
        fit.parameters.modes.clone(),
        fit.parameters.remainder_m_per_n,
    )?;
    let above = sum
        .damped_zeros()?
        .into_iter()
        .filter(|zero| zero.s.im >= 0.0);
    Ok(above
        .map(|zero| uncertain(fit, zero.s, zero.kind))
        .collect())
}

fn uncertain(fit: &ModalFit, s: Complex<f64>, kind: ZeroKind) -> UncertainZero {
    let rows = rows(fit, s);
    let product =
        |i: usize, j: usize| (rows.row(i) * &fit.covariance * rows.row(j).transpose())[(0, 0)];
    let real = s.im == 0.0;
    let covariance = if real {
        [[product(0, 0), 0.0], [0.0, 0.0]]
    } else {
        [0, 1].map(|i| [0, 1].map(|j| product(i, j)))
    };
    let rhp_probability = Estimate {
        value: -s.re,
        sigma: covariance[0][0].sqrt(),
    }
    .below_zero_probability();
    UncertainZero {
        s,
        covariance,
        rhp_probability,
        kind,
    }
}

/// d(Re z)/d theta and d(Im z)/d theta, 2 x parameters.
fn rows(fit: &ModalFit, z: Complex<f64>) -> DMatrix<f64> {
    let modes = &fit.parameters.modes;
    let by_square = |t: &ModalTerm| -t.resonance(z) * t.resonance(z) * t.residue_per_kg;
    let by_z: Complex<f64> = modes
        .iter()
        .map(|t| by_square(t) * (z * 2.0 + 2.0 * t.damping_ratio * t.omega_rad_s))
        .sum();
    let by = |entry: &Entry| match *entry {
        Entry::Omega(k) => {
            by_square(&modes[k]) * (z * (2.0 * modes[k].damping_ratio) + 2.0 * modes[k].omega_rad_s)
        }
        Entry::Damping(k) => by_square(&modes[k]) * z * (2.0 * modes[k].omega_rad_s),
        Entry::Residue(k) => modes[k].resonance(z),
        Entry::Remainder => Complex::new(1.0, 0.0),
        Entry::Delay => Complex::new(0.0, 0.0),
    };
    let moves: Vec<Complex<f64>> = fit
        .parameters
        .entries()
        .iter()
        .map(|entry| -by(entry) / by_z)
        .collect();
    DMatrix::from_fn(2, moves.len(), |row, column| {
        if row == 0 {
            moves[column].re
        } else {
            moves[column].im
        }
    })
}
