//! What a recording shows of the stage: its frequency response, modes and verdict.
//!
//! A recording is read into signals (`read_run`, `signal_builder`), cut into parts (`segments`), and its responses are estimated
//! (`response_estimate`, `closed_responses`); `recorded_excitation` does all of this and fits the modes. Positions in missing ticks are
//! predicted by the fitted modes (`missing_ticks`). `measured_frf` reads a
//! response from a file, for a loop around a measured plant (`response_points`); `frf_checks` and `conventions` refuse one that does not
//! belong to the bench. `external_response` reads that of any stage.

mod aligned_readings;
mod analysed_run;
mod analysis_error;
mod closed_responses;
mod conventions;
mod ending;
mod excited_run;
mod external_response;
mod fade_out;
mod frf_checks;
mod measured_frf;
mod missing_ticks;
mod model_response;
mod read_run;
mod recorded_excitation;
mod response_estimate;
mod response_points;
mod run_signals;
mod segments;
mod signal_builder;
mod swept_band;

pub use analysed_run::AnalysedRun;
pub use analysis_error::{AnalysisError, ClosedLoopError};
pub(crate) use conventions::check_static_conventions;
pub use ending::{EndKind, Ending};
pub use external_response::{ExternalResponse, NegativeResponse};
pub(crate) use frf_checks::{check_frf, check_rate, judge_excess};
pub use measured_frf::{FrfError, MeasuredFrf, recorded_frf};
pub use model_response::ModelResponse;
pub use read_run::{ReadSignals, open_with_signals};
pub use recorded_excitation::{Analysis, AnalysisPhase, AnalysisProgress, analyse, never_cancels};
pub(crate) use recorded_excitation::{
    ModalStep, cautions, estimated, run_signals, run_signals_of, scope_of_model,
};
pub use response_estimate::ClosedResponses;
pub(crate) use response_estimate::ResponseEstimate;
pub(crate) use response_points::{points, roll_off, variance};
