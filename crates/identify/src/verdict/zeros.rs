//! The zeros of a fit, each with its covariance.
//!
//! ```text
//! G(z) = R + sum of (r + q z)/(z^2 + 2 zeta w z + w^2)              dz = - (dG/dtheta . dtheta) / (dG/dz)
//! ```
//!
//! With the rows Re and Im of -(dG/dtheta)/(dG/dz) as J, the covariance of (Re z, Im z) is J cov(theta) J^T. Where two zeros
//! coincide, dG/dz is zero and the covariance is unbounded: the zeros are then undetermined.

use nalgebra::{Complex, DMatrix};
use serde::ser::{Serialize, SerializeStruct, Serializer};

use crate::Estimate;
use crate::modal::{ModalFit, mechanics_derivative, mechanics_slope};
use bench_plant::PlantError;
use bench_plant::zeros::ZeroKind;

/// A zero with its covariance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct UncertainZero {
    /// The zero in rad/s; of a conjugate pair the one above the real axis.
    pub s: Complex<f64>,
    /// Covariance of real and imaginary part in (rad/s)^2.
    pub covariance: [[f64; 2]; 2],
    /// Probability that it lies in the right half plane, for normally distributed errors.
    pub rhp_probability: f64,
    /// Its kind at its estimated location.
    pub kind: ZeroKind,
    /// How far in rad/s the fitted response has it from where the modes have it, which is part of its covariance; 0 of real residues.
    pub difference: Complex<f64>,
}

impl UncertainZero {
    /// The real part with its standard deviation.
    pub fn real_part(&self) -> Estimate {
        Estimate {
            value: self.s.re,
            sigma: self.covariance[0][0].sqrt(),
        }
    }

    /// Whether the error of its real part is rather that of the model than that of the noise.
    pub(super) fn is_uncertain_by_model(&self) -> bool {
        self.difference.re.powi(2) > 0.5 * self.covariance[0][0]
    }
}

impl UncertainZero {
    /// A complex zero at another place, with the difference added to its covariance.
    pub(super) fn moved_to(self, s: Complex<f64>) -> UncertainZero {
        let moved = s - self.s;
        let moved = [moved.re, moved.im];
        let covariance =
            [0, 1].map(|i| [0, 1].map(|j| self.covariance[i][j] + moved[i] * moved[j]));
        let kind = match (s.re > 0.0, self.kind) {
            (true, _) => ZeroKind::Cnmp,
            (false, ZeroKind::Cnmp) => ZeroKind::Mmp,
            (false, kind) => kind,
        };
        UncertainZero {
            difference: s - self.s,
            ..UncertainZero::new(s, covariance, kind)
        }
    }

    fn new(s: Complex<f64>, covariance: [[f64; 2]; 2], kind: ZeroKind) -> UncertainZero {
        let mirrored = Estimate {
            value: -s.re,
            sigma: covariance[0][0].sqrt(),
        };
        UncertainZero {
            s,
            covariance,
            rhp_probability: mirrored.below_zero_probability(),
            kind,
            difference: Complex::new(0.0, 0.0),
        }
    }
}

impl Serialize for UncertainZero {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut zero = serializer.serialize_struct("UncertainZero", 5)?;
        zero.serialize_field("re_rad_s", &self.s.re)?;
        zero.serialize_field("im_rad_s", &self.s.im)?;
        zero.serialize_field("covariance", &self.covariance)?;
        zero.serialize_field("rhp_probability", &self.rhp_probability)?;
        zero.serialize_field("kind", self.kind.name())?;
        zero.end()
    }
}

/// The zeros of a fit with damping, lowest frequency first.
///
/// # Errors
/// When the zeros cannot be computed.
pub fn zeros(fit: &ModalFit) -> Result<Vec<UncertainZero>, PlantError> {
    let sum = fit.parameters.sum()?;
    let above = sum
        .damped_zeros()?
        .into_iter()
        .filter(|zero| zero.s.im >= 0.0);
    Ok(above
        .map(|zero| UncertainZero::new(zero.s, zero_covariance(fit, zero.s), zero.kind))
        .collect())
}

/// J cov(theta) J^T; a real zero has no imaginary part.
fn zero_covariance(fit: &ModalFit, s: Complex<f64>) -> [[f64; 2]; 2] {
    let rows = derivatives(fit, s);
    let entry =
        |i: usize, j: usize| (rows.row(i) * &fit.covariance * rows.row(j).transpose())[(0, 0)];
    if s.im == 0.0 {
        [[entry(0, 0), 0.0], [0.0, 0.0]]
    } else {
        [0, 1].map(|i| [0, 1].map(|j| entry(i, j)))
    }
}

/// d(Re z)/d theta and d(Im z)/d theta, 2 x parameters.
pub(super) fn derivatives(fit: &ModalFit, z: Complex<f64>) -> DMatrix<f64> {
    let by_z = mechanics_slope(&fit.parameters, z);
    let free = fit.parameters.free();
    let moves: Vec<Complex<f64>> = free
        .iter()
        .map(|parameter| -mechanics_derivative(&fit.parameters, *parameter, z) / by_z)
        .collect();
    DMatrix::from_fn(2, moves.len(), |row, column| {
        if row == 0 {
            moves[column].re
        } else {
            moves[column].im
        }
    })
}
