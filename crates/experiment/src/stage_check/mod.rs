//! The check of a stage before a loop closes with a certificate: a run in open loop of about one second, with a small step and two
//! tones, must agree with the certificate in static compliance, in its sign, and in the phase near the crossover.
//!
//! ```text
//!  certificate, loop --shot--> StageCheckSettings --run, interlocks active--> recording --estimate--> ShotResponse
//!                                                                                                  |  comparison
//!                                                                    loop closes, or StageCheckError <+
//! ```
//!
//! Swapped leads, another load and another stage are found before the loop closes.

mod comparison;
mod error;
mod estimate;
mod figures;
mod rest;
mod shot;

pub use comparison::StageCheck;
pub use error::StageCheckError;
pub use figures::{PhaseComparison, StaticComparison};
pub use rest::RestAfterCheck;
pub(crate) use shot::Shot;
