//! The devices behind amplifier and probe: the simulated stage, or a real device with its own settings.
//!
//! To register a new probe, add one line to the register in `probe.rs`. To register a new amplifier, add a variant to
//! [`AmplifierDevice`] with its settings.

mod amplifier;
mod probe;

pub use amplifier::*;
pub use probe::*;
