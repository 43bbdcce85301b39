//! Models of the mechanics.
//!
//! ```text
//!  settings -> Structure (M, C, K, vectors) -> modes (ModalModel) -> simulation, FRF, margins
//!                          |                            |
//!                          v                            v
//!                       zeros (crate::model::zeros)         loci that veer or cross (crate::model::veering)
//! ```
//!
//! | `plant.model` | made in | from |
//! |---|---|---|
//! | `sr4dof` | `sr4dof.rs` | its four parallelograms, Eq. (2-5) |
//! | `xy` | `xy.rs` | its sixteen parallelograms, section 2.2.4 |
//! | `lumped` | `lumped.rs` | named masses and springs: sections 4.4.1 and 4.4.3, Fig 4-3, or a stage of yours |
//! | `modal` | `by_modes.rs` | residues, frequencies and damping ratios: Eqs. (3-3) to (3-15), (6-1), (6-3) |
//!
//! All four are one [`Structure`] to the rest of the program. How to describe a stage of your own as masses and springs
//! stands, with an example, in `bench-config/README.md`.
//!
//! Signs: positive current gives positive force, positive force gives positive displacement at low frequency.

mod beam;
mod by_modes;
mod chain;
mod damping;
mod exponential;
mod kinematics;
pub(crate) mod linear_algebra;
mod lumped;
mod modal;
mod port;
mod quadratic;
mod sampled;
pub mod sr4dof;
mod structure;
mod xy;

pub(crate) use beam::Beam;
pub use chain::{ChainSettings, LoopPlant};
pub(crate) use exponential::exponential;
pub use modal::{ModalModel, Mode, Sign};
pub use port::Port;
pub(crate) use quadratic::{Disturbance, QuadraticSr4dof, QuadraticState};
pub use sampled::{Block, DiscretePlant, PlantState};
pub use sr4dof::holding_force_n;
pub use structure::Structure;

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
    #[error(
        "the eigenvalues of {what} did not converge; scale the model's masses and stiffnesses to similar sizes"
    )]
    NoConvergence {
        /// Which matrix.
        what: &'static str,
    },
    /// A rigid body mode, or one that buckles, where a held stage is meant.
    #[error(
        "mode {number} has the eigenvalue {eigenvalue_rad2_s2:.3e} rad^2/s^2, which beside the fastest mode's cannot be told from zero, or is negative: no spring holds the stage in that direction, or another mass is too light, or another spring too stiff, to be computed with"
    )]
    Free {
        /// Which mode, from 1.
        number: usize,
        /// Its eigenvalue.
        eigenvalue_rad2_s2: f64,
    },
    /// No force of the actuator reaches the probe.
    #[error(
        "the residues of all modes are zero: what the actuator moves, the probe does not see; join the two by springs, or change where they act"
    )]
    NoResponse,
    /// Damping in proportion to mass holds a body to ground.
    #[error(
        "{mass_per_s} 1/s of damping in proportion to mass would hold a free body to ground; give damping of kind \"uniform\", or \"rayleigh\" with mass_per_s = 0"
    )]
    DampedFreeBody {
        /// The coefficient of the mass matrix.
        mass_per_s: f64,
    },
    /// A model that is only known linearised.
    #[error(
        "the model `{model}` has no geometry beyond the linear one; set sim.geometry = \"linear\""
    )]
    NotQuadratic {
        /// Which model.
        model: &'static str,
    },
    /// A free body has no static compliance.
    #[error("{0} is not defined for a free body, which no spring holds in place")]
    FreeBody(
        /// What is asked for.
        &'static str,
    ),
}

/// The structure that the settings describe.
pub fn build(settings: &PlantSettings) -> Result<Structure, PlantError> {
    match settings {
        PlantSettings::Sr4dof(settings) => sr4dof::structure(settings),
        PlantSettings::Xy(settings) => xy::structure(settings),
        PlantSettings::Lumped(settings) => lumped::structure(settings),
        PlantSettings::Modal(settings) => Ok(by_modes::structure(settings)),
    }
}

/// The same with C = 0, whatever the damping of the settings.
pub fn undamped(settings: &PlantSettings) -> Structure {
    match settings {
        PlantSettings::Sr4dof(settings) => sr4dof::undamped(settings),
        PlantSettings::Xy(settings) => xy::undamped(settings),
        PlantSettings::Lumped(settings) => lumped::undamped(settings),
        PlantSettings::Modal(settings) => by_modes::undamped(settings),
    }
}

/// Where a force may act on the model and a probe may look, in the model's order; none for a plant given by its modes.
pub fn ports(settings: &PlantSettings) -> Vec<Port> {
    match settings {
        PlantSettings::Sr4dof(settings) => sr4dof::ports(settings),
        PlantSettings::Xy(settings) => xy::ports(settings),
        PlantSettings::Lumped(settings) => lumped::ports(settings),
        PlantSettings::Modal(_) => Vec::new(),
    }
}
