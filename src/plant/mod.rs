//! Models of the mechanics.
//!
//! ```text
//!  settings -> Structure (M, C, K, vectors) -> modes (Modal) -> simulation, FRF, margins
//!                          |              |  sum: what shows between force and probe
//!                          |              v
//!                          |           sequence of dominant modes, Tables 3-1 to 3-4, step responses, break points
//!                          v
//!                        zeros, kinds -> loci over a setting, maps, bounds on bandwidth and sensitivity
//!
//!  modes over a setting -> loci that veer or cross
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
mod bounds;
mod break_points;
mod by_modes;
mod chain;
mod damping;
mod exponential;
mod kinematics;
mod linear_algebra;
mod locus;
mod lumped;
mod map;
mod modal;
mod quadratic;
mod sampled;
mod sequence;
mod sr4dof;
mod step;
mod structure;
mod sum;
mod tables;
mod veering;
mod xy;
mod zeros;

pub use bounds::{Bound, bandwidth_rad_s, guaranteed_peak, opening_angle, opening_angle_allowed};
pub use break_points::{critical_damping, critical_residues, critical_sums, touching_damping, two_mode_break_points};
pub use chain::Chain;
pub(crate) use exponential::exponential;
pub use locus::{Change, Crossing, Locus, Plane};
pub use map::cnmp_map;
pub use modal::{Modal, Mode, Sign};
pub(crate) use quadratic::{Load, Quadratic, QuadraticState};
pub use sampled::{Block, Motion, Sampled};
pub use sequence::{Dominant, Sequence, dominant_sequence, sign_sequence};
pub use step::{InitialStep, StepResponse};
pub use structure::Structure;
pub use sum::{ModalSum, Term};
pub use tables::{Place, Row, TABLES, Table, table_of};
pub use veering::{Loci, Meeting, ModesAt};
pub use zeros::{Kinds, Zero, ZeroKind, cnmp_pairs, damped_zeros, phase_drop_deg, undamped_zeros};

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
    #[error("the model `{model}` has no geometry beyond the linear one; set sim.geometry = \"linear\"")]
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
