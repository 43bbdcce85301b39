//! Control laws and their margins.
//!
//! A controller remains a cascade of first and second order sections from its TOML file to the loop, and is never
//! expanded to a polynomial: as one 8th order polynomial at 5 kHz the fast controller cannot be discretised in double
//! precision.
//!
//! ```text
//!  file -> Section (continuous) -> Biquad (Tustin, section by section) -> SectionController --+
//!    |          \-> continuous margins                                                       |
//!    +-> transfer ([tf], [zpk], [ss]) -> Section (continuous), or Biquad (discrete) -----------+
//!    +-> laws (another kind, `[law]`) -------------------------------------> ControlLaw <-----+
//!                                                                             |   \-> ClosedLoop: margins, predicted step
//!                                                                             v
//!                                                                  rt::program::Control
//! ```
//!
//! Sign convention: u = C (r - y). Positive current moves the stage in the positive direction, so C has positive gain.
//! Coefficients are immutable and separate from the state.

#![deny(unsafe_code)]

mod biquad;
mod closed_loop;
mod controller;
mod convex;
mod encirclements;
mod error;
mod features;
mod file;
mod import;
mod import_error;
mod inverse;
mod landmarks;
mod law;
mod laws;
mod loop_margins;
mod margins;
pub mod measured;
mod minimum_time;
mod pole;
mod quadratic;
mod section;
mod section_settings;
mod state_space;
mod step_metrics;
mod swept;
mod transfer;
mod tuned;
pub mod tuning;
mod unstable;

pub use biquad::{Biquad, BiquadState};
pub use closed_loop::{ClosedLoop, StepMode};
pub use controller::{Controller, ControllerState, SectionController, continuous_response};
pub use error::ControllerError;
pub use file::{CONTROLLERS, ControllerFile, ControllerText};
pub use import::{ImportOptions, Imported, NumericArray, Value, Variables, import, read_variables};
pub use import_error::{FormatError, ImportError};
pub use inverse::{InverseFilter, inverse_filter};
pub use law::{ControlDesign, ControlLaw, LawInput, LinearLaw, OpenLoopPoles};
pub use laws::{ControlLawSettings, RepetitiveLaw, StateSpaceLaw, register_law};
pub use loop_margins::{Crossing, LoopMargins};
pub use margins::grid;
pub use margins::{Margins, PhaseCrossing};
pub use minimum_time::{
    MinimumTime, MinimumTimeError, StepLimits, StepPlant, StepTiming, minimum_time,
};
pub use pole::{Pole, listed_poles};
pub use section::{Section, SectionError};
pub use section_settings::{SectionSettings, SectionsError, checked_sections};
pub use state_space::StateSpace;
pub use step_metrics::{SETTLING_BAND, StepMeter, StepMetrics, step_metrics};
pub use swept::{SweptLimits, swept_reference_amplitudes};
pub use transfer::{
    Agreement, Cascade, DiscreteDesign, Domain, Factors, GainUnit, Inexact, RootPlace, Roots,
    SsFile, SsSettings, TfFile, TfSettings, TransferError, TransferSettings, TransferTable,
    ZpkFile, ZpkSettings,
};
pub use tuned::TunedDesign;
pub use unstable::MAX_INTEGRATORS;
