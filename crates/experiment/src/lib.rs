//! Runs of the bench, from arming to the complete recording, and the analysis of the recordings.
//!
//! ```text
//!  Plan (config -> program, texts)  ->  LiveRig: loop thread + recorder thread, a supervisor outside  ->  Run
//!                                                                                    Recording -> replay, analyse
//! ```
//!
//! The supervisor cannot delay the loop: it watches counters and the state of the recorder, and sends requests to the loop through a
//! ring. Signals reach the loop directly. The rig stays open for several runs.

#![deny(unsafe_code)]

mod analysis;
pub mod calibration;
pub mod campaign;
pub mod certificate;
mod errors;
pub mod evidence;
mod forecast;
pub mod linearity;
mod live;
mod plan;
mod replay;
mod results;
mod run;
pub mod run_comparison;
pub mod sequential;
pub mod stage_check;
pub mod tuning;

pub use analysis::{
    Analysis, AnalysisError, AnalysisPhase, AnalysisProgress, ClosedLoopError, ClosedResponses,
    Ending, FrfError, MeasuredFrf, ModelResponse, ReadSignals, analyse, analyse_opened,
    analyse_with_progress, open_with_signals, recorded_frf,
};
pub use errors::{
    ErrorKind, ErrorObject, ExperimentError, MotorError, RemoteError, RunError, option_in,
};
pub use forecast::{
    AmplitudePlanError, ExcitationPlan, MotorForecast, MotorSummary, PlanLimits, ResponseSource,
    default_amplitude, extremes, predicted_extremes, rig_model, shape_amplitude,
};
pub use live::{
    DeviceNames, Feed, FeedSender, FeedSource, LiveRig, OpenBench, Opening, RecordingDefect,
    RemoteRecording, Run, RunHooks, StopCause, StopSignals, TripCount, abandon_on_signal, run,
    stop_on_signal, survive_file_size_limit,
};
pub use plan::{
    CommandSummary, Description, DescriptionError, Invocation, MarginError, MotorStart, Plan,
    PlanError, RatedController, RunKind, ShapedMode, Stage, TuneRefusal, check_tune, closed_loop,
    operator_name, require_margins, residuals, run_name, run_note,
};
pub use replay::{Difference, ReplayError, Replayed, replay};
pub use results::{
    BasicResults, ControlRun, ErrorSpectrum, Extent, LoopCurves, LoopModel, MeasuredLoopMargins,
    Overview, PredictedSine, PredictedSpectrum, PredictedStep, RunFigures, SineResponse,
    StepResponse, TrackingMetrics, control_run, measured_margins, overview, predicted_step,
    run_figures, step_response, tracking_metrics,
};
pub use run::{
    MotorHandling, PlannedStageCheck, RigOwner, RunOrder, RunReport, RunSummary, Runner, Setup,
    TimingSummary, TripSummary, check_calibration, check_named_files, close,
};
