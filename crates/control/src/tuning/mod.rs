//! Design of a controller for a set of plants.
//!
//! ```text
//!  operating points, tolerances -> plant ---------------+
//!  measured responses -> measured_plant, uncertainty ----+
//!  modes that the model lacks ---> unmodelled (bound U) -+-> sampled -> requirement, variance (slacks and their derivatives)
//!  lines of the floor, noise ----> disturbance ----------+          |
//!                                                                    v
//!  cascade (parameters are logarithms) <--- subproblem (linear programme) <--- descent (trust region, nyquist)
//!                                                                    |
//!                    search (rising order, several starts) -> design -> verification (fine grid, binding requirements)
//! ```
//!
//! The controller is evaluated at s = j (2/T) tan(w T/2), where a continuous section has exactly the response of the section that
//! Tustin's rule makes of it: what is designed is what runs.

mod binding;
mod bound;
mod cascade;
mod classical_margins;
mod cone_programme;
mod curves;
mod descent;
mod design;
mod disturbance;
mod disturbance_spectrum;
mod error;
mod figures;
mod margin_disc;
mod measured_plant;
mod nyquist;
mod plant;
mod requirement;
mod sampled;
mod search;
mod subproblem;
mod task;
mod uncertainty;
mod unmodelled;
mod variance;
mod verification;

pub use binding::Binding;
pub use bound::ConvexBound;
pub use cascade::{Cascade, ParameterLimits};
pub use curves::{LoopCurve, loop_curves};
pub use design::{Design, DesignTask, bound_of, design, evaluate};
pub use disturbance::{Disturbance, PositionDisturbance};
pub use disturbance_spectrum::DisturbanceSpectrum;
pub use error::{Conflict, TuneError};
pub use figures::PlantFigures;
pub use margin_disc::{DiscError, MarginDisc};
pub use measured_plant::MeasuredPlant;
pub use plant::{DesignPlant, Tolerances};
pub use requirement::{Goal, Kind, Requirements, SensitivityLimit};
pub use search::Effort;
pub use task::{DesignOptions, NamedPlant, RigModel};
pub use uncertainty::{DISC_SIGMAS_95, IdentifiedResponse, loop_plant};
pub use unmodelled::UnmodelledBound;
