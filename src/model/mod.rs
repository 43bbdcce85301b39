//! Computations on the model of the mechanics, without a bench.
//!
//! ```text
//!  settings -> plant (structure, modes, sampled responses) -> zeros (kinds, loci, maps) -> veering -> study (tolerances)
//! ```

pub mod study;
pub mod veering;
