//! Zeros of the response from the actuator to the probe, their kinds, and the modes that determine them.
//!
//! ```text
//!  Structure -> zeros, kinds -> loci over a setting, maps
//!  modes     -> sum of the modes that can be observed between force and probe
//! ```
//!
//! Kinds and signs are those of the undamped system unless a name contains "damped". The
//! terms are defined in `docs/glossary.md`.

mod kinds;
mod locus;
mod map;
mod rational;
mod sum;
mod term;

pub use kinds::{
    Zero, ZeroCounts, ZeroKind, cnmp_pairs, damped_zeros, phase_drop_deg, undamped_zeros,
};
pub use locus::{Crossing, KindChange, Locus, LocusPlane};
pub use map::cnmp_map;
pub use sum::ModalSum;
pub use term::ModalTerm;
