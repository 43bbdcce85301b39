//! Excitations in amperes for identification, and references in metres for the closed loop.
//!
//! ```text
//!  [excitation] kind -> ExcitationDesign (settings) -> Excitation -> extremes by the model, refused beyond the limits
//!  [control.reference] kind -> ReferenceDesign (settings) -> Reference -> command (shaping, feedforward)
//! ```
//!
//! Each is a function of the tick number alone and is built before the run, so that a run can be repeated and replayed. The
//! settings of a kind are in its own file. A new excitation is one file and one line in `kinds.rs`; a new reference is one file
//! and one line in `reference/mod.rs`. A program that uses this library can run its own [`Excitation`] or [`Reference`] without
//! either.

#![deny(unsafe_code)]

mod amplitude;
mod check;
mod chirp;
pub mod command;
mod design;
mod extremes;
pub mod fourier;
mod kinds;
mod limits;
mod multisine;
mod own;
mod periodic;
mod prbs;
mod reference;
mod repeated;
mod shape;
mod stage_check;
mod staircase;
mod stepped_sine;
mod sweep;
#[cfg(test)]
mod test_profile;
mod waveform;
mod zero_current;

pub use amplitude::{AmplitudeCurve, AmplitudePoint, TravelPoint};
pub use check::ExcitationError;
pub use chirp::Chirp;
pub use design::{ChosenExcitation, ExcitationDesign, Length, SharedSettings};
pub use extremes::Extremes;
pub use kinds::{ExcitationKind, ExcitationTables};
pub use limits::Limits;
pub use multisine::{Lines, MultisineSettings};
pub use own::{OwnExcitation, register_excitation};
pub use periodic::Periodic;
pub use prbs::PrbsSettings;
pub use reference::{
    FileReference, HoldReference, OwnReference, RampReference, RandomReference, ReferenceContext,
    ReferenceDesign, ReferenceError, ReferenceSettings, SCurveReference, SineReference,
    SquareReference, StepOfReference, StepReference, SweptReference, TriangleReference,
    register_reference,
};
pub use shape::{CurrentLimit, MAX_POINTS, shaped_amplitude};
pub use stage_check::{StageCheckSettings, StageCheckSignal, Tone};
pub use staircase::{Staircase, StaircaseSteps};
pub use stepped_sine::{Spacing, SteppedSineSettings};
pub use sweep::{ChirpSettings, Sweep, SweptSine};
pub use waveform::{Excitation, Pattern, Reference, Window};
pub use zero_current::ZeroCurrent;
