//! What drives the stage: excitations in amperes for identification, references in metres for the closed loop.
//!
//! Both are functions of the tick number alone, made before the run, so that a run can be repeated and replayed. A new
//! excitation is one file with the trait and one line where `bench chirp` chooses.

mod chirp;
mod extremes;
mod reference;
mod staircase;

pub use chirp::{Chirp, ChirpError};
pub use extremes::Extremes;
pub use reference::{Reference, ReferenceError, reference, reference_text};
pub use staircase::Staircase;

/// A current over time.
pub trait Excitation: Send {
    /// Amperes at a tick of the excitation, counted from 0. *In the tick.*
    fn current_a(&self, tick: u64) -> f64;

    /// Whether the tick belongs to the excitation proper, not to the quiet before or after. *In the tick.*
    fn active(&self, tick: u64) -> bool;

    /// Length in ticks, quiet included.
    fn ticks(&self) -> u64;
}
