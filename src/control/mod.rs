//! Controllers and their margins.
//!
//! A controller is a cascade of first and second order sections from its TOML file to the loop, never a polynomial: as one
//! 8th order polynomial at 5 kHz the fast controller cannot be discretised in double precision.
//!
//! ```text
//!  file -> Section (continuous) -> Biquad (Tustin, section by section) -> Controller::update in the loop
//!               \-> margins, continuous and sampled, and the predicted step
//! ```
//!
//! Sign convention: u = C (r - y). Positive current moves the stage in the positive direction, so C has positive gain.

mod biquad;
mod closed_loop;
mod controller;
mod file;
mod margins;
mod section;
mod step_metrics;
mod swept;

pub use biquad::Biquad;
pub use closed_loop::ClosedLoop;
pub use controller::{Controller, continuous_response};
pub use file::{ControllerError, ControllerFile, ControllerText};
pub use margins::grid;
pub use margins::{Crossing, Margins};
pub use section::Section;
pub use step_metrics::{StepMeter, StepMetrics, step_metrics};
pub use swept::swept_reference_amplitudes;
