//! Two modes of close frequencies (Chapter 4): loci that approach each other as a setting varies, and diverge again
//! or cross.
//!
//! ```text
//!  Structure -> loci, veering point -> close modes (Eq. 4-1) -> conditions C4-1 to C4-4y -> propositions P4-1 to P4-2y
//!                        |
//!                        v
//!                  quadrants and octants -> places for actuator and probe (placement)
//! ```
//!
//! The terms are defined in `docs/glossary.md`.

mod close_modes;
pub mod conditions;
mod loci;
mod modes_at;
mod pair;
pub mod placement;
pub mod propositions;
mod quadrants;
mod remedies;
pub mod report;
#[cfg(test)]
mod tests;
mod trajectory;

pub use close_modes::{CloseModes, Remainder};
pub use loci::{Loci, Meeting};
pub use modes_at::ModesAt;
pub use pair::{PairError, close_pair, meeting_pair, require_meeting};
pub use quadrants::{QuadrantDiagram, QuadrantSummary};
pub use trajectory::{Ports, Sample, Trajectory, ZeroConfiguration, as_configured};
