//! Models of the mechanics.
//!
//! ```text
//!  settings -> Structure (M, C, K, vectors) -> modes (Modal) -> simulation, FRF, margins
//!                                    \-> zeros, kinds, sequences
//! ```
//!
//! Signs: positive current gives positive force, positive force gives positive displacement at low frequency.

mod chain;
mod damping;
mod exponential;
mod linear_algebra;
mod modal;
mod sampled;
mod sequence;
mod sr4dof;
mod structure;
mod zeros;

pub use chain::Chain;
pub(crate) use exponential::exponential;
pub use modal::{Modal, Mode, Sign};
pub use sampled::{Block, Motion, Sampled};
pub use sequence::{dominant_sequence, sign_sequence};
pub use structure::Structure;
pub use zeros::{Zero, ZeroKind, cnmp_pairs, damped_zeros, phase_drop_deg, undamped_zeros};

use crate::config::PlantSettings;

/// A model that cannot be analysed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// The mass matrix is not positive definite.
    #[error(
        "the mass matrix is not positive definite: some coordinate carries no mass; give every moving stage a mass above zero"
    )]
    SingularMass,
    /// An eigenvalue iteration did not end.
    #[error("the eigenvalues of {what} did not converge; scale the model's masses and stiffnesses to similar sizes")]
    NoConvergence {
        /// Which matrix.
        what: &'static str,
    },
    /// A rigid body mode where a grounded stage is meant.
    #[error(
        "mode {number} has the eigenvalue {eigenvalue_rad2_s2:.3e} rad^2/s^2: the stage is not held by springs in that direction; ground it"
    )]
    Free {
        /// Which mode, from 1.
        number: usize,
        /// Its eigenvalue.
        eigenvalue_rad2_s2: f64,
    },
}

/// The structure that the settings describe.
pub fn build(settings: &PlantSettings) -> Result<Structure, PlantError> {
    match settings {
        PlantSettings::Sr4dof(settings) => sr4dof::structure(settings),
    }
}
