//! Two modes of close frequencies (Chapter 4): loci that approach each other as a setting varies, and part or cross.
//!
//! ```text
//!  Structure -> loci, veering point -> close modes (Eq. 4-1) -> conditions C4-1 to C4-4y -> propositions P4-1 to P4-2y
//!                        |
//!                        v
//!                  quadrants and octants (picture) -> where to put actuator and probe (placement)
//! ```

mod close_modes;
pub mod conditions;
mod course;
mod loci;
mod picture;
mod placement;
#[cfg(test)]
mod properties;
pub mod propositions;

pub use close_modes::{CloseModes, Remainder};
pub use course::{Sample, Trajectory, ZeroConfiguration, as_configured, station};
pub use loci::{Loci, Meeting, ModesAt};
pub use picture::QuadrantDiagram;
pub use placement::{Trial, trial};
