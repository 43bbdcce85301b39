//! The figures of recorded runs beside those of the model: closed loops, steps, sines, and runs without a frequency response.
//!
//! The signals of a closed loop (`closed_signals`) give its errors (`tracking`, `error_spectrum`) and responses (`step_response`,
//! `sine_response`, `measured_margins`); `overview` and `run_figures` are about a whole run. `control_run` and `basic_results` combine
//! them for reports.

mod basic_results;
mod closed_signals;
mod control_run;
mod error_spectrum;
mod measured_margins;
mod overview;
mod run_figures;
mod sine_response;
mod step_response;
mod tracking;

pub use basic_results::BasicResults;
pub(crate) use closed_signals::ClosedSignals;
pub use control_run::{ControlRun, LoopModel, control_run};
pub(crate) use error_spectrum::error_spectrum;
pub use error_spectrum::{ErrorSpectrum, PredictedSpectrum};
pub(crate) use measured_margins::margins_around;
pub use measured_margins::{LoopCurves, MeasuredLoopMargins, measured_margins};
pub use overview::{Extent, Overview, overview};
pub use run_figures::{RunFigures, run_figures};
pub use sine_response::SineResponse;
pub use step_response::{StepResponse, step_response};
pub(crate) use tracking::steady_tick;
pub use tracking::{TrackingMetrics, tracking_metrics};
