//! Runs of the bench, from arming to the complete recording, and the analysis of the recordings.
//!
//! ```text
//!  Plan (config -> program, texts)  ->  LiveRig: loop thread + recorder thread, a supervisor outside  ->  Run
//!                                                                                    Recording -> replay, analyse
//! ```
//!
//! The supervisor cannot delay the loop: it watches counters and the state of the recorder, and sends requests to the loop through a
//! ring. Signals reach the loop directly. The rig stays open for several runs.
//!
//! Each module imports only from modules above it:
//!
//! | module | for |
//! |---|---|
//! | `certificate` | what a chirp showed about a rig, as the text that a plan contains |
//! | `stage_check` | the short run in open loop that compares a stage with its certificate |
//! | `plan` | what a run will do: settings, program, reference, and whether the loop is stable by the model |
//! | `analysis` | what a recording shows of the stage: signals, frequency response, modes, verdict |
//! | `errors` | why an experiment was refused or failed |
//! | `live` | the open rig with its loop, recorder, supervisor and stop signals |
//! | `replay` | the recorded readings through the same loop again |
//! | `evidence` | certificates are issued, and compared with the rig of today before a loop closes |
//! | `forecast` | what a run will do by the model, before it starts: travel, current, amplitudes, heat, response of the loop |
//! | `run` | the runner of plans, on an own rig or on that of another process, and the summary of a run |
//! | `calibration` | calibration by static steps and a short chirp |
//! | `sequential` | short chirps until the verdict is certain |
//! | `campaign` | chirps over a grid of operating points and asymmetries, and their evaluation |
//! | `results` | the figures of recorded runs for reports: closed loops, steps, rest positions |
//! | `outputs` | the result files of an analysis, with its certificate, and the stable JSON |
//! | `run_comparison` | differences between recordings and their significance |
//! | `tuning` | plants of a controller design from measured responses |
//! | `linearity` | the same multisine at several amplitudes |

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
pub mod outputs;
mod plan;
mod replay;
mod results;
mod run;
pub mod run_comparison;
pub mod sequential;
pub mod stage_check;
pub mod tuning;

pub use analysis::{
    AnalysedRun, Analysis, AnalysisError, AnalysisPhase, AnalysisProgress, ClosedLoopError,
    ClosedResponses, EndKind, Ending, ExternalResponse, FrfError, MeasuredFrf, ModelResponse,
    NegativeResponse, ReadSignals, analyse, never_cancels, open_with_signals, recorded_frf,
};
pub use errors::{
    ErrorKind, ErrorObject, ExperimentError, MotorError, RemoteError, RunError, option_in,
};
pub use forecast::{
    AmplitudePlanError, CalibrationForecast, ControlForecast, ExcitationPlan, ExpectedExtremes,
    MotorForecast, MotorSummary, PlanLimits, PredictedLoop, PredictedSine, PredictedStep,
    ResponseSource, default_amplitude, extremes, predicted_extremes, predicted_step, rig_model,
    shape_amplitude,
};
pub use live::{
    DeviceNames, Feed, FeedSender, FeedSource, LiveRig, OpenBench, Opening, RecordingDefect,
    RemoteRecording, Run, RunEnd, RunHooks, StopCause, StopSignals, TripCount, abandon_on_signal,
    run, stop_on_signal, survive_file_size_limit,
};
pub use plan::{
    CommandSummary, Description, DescriptionError, Invocation, MarginError, MotorStart, Plan,
    PlanError, RatedController, RunKind, ShapedMode, Stage, TuneRefusal, check_tune, closed_loop,
    operator_name, require_margins, residuals, run_name, run_note,
};
pub use replay::{Difference, ReplayError, Replayed, replay};
pub use results::{
    BasicResults, ControlRun, ErrorSpectrum, Extent, LoopCurves, LoopModel, MeasuredLoopMargins,
    Overview, PredictedSpectrum, RunFigures, SineResponse, StepResponse, TrackingMetrics,
    control_run, measured_margins, overview, run_figures, step_response, tracking_metrics,
};
pub use run::{
    MotorHandling, PlannedRun, PlannedStageCheck, RigOwner, RunConditions, RunReport, RunSummary,
    Runner, Setup, TimingSummary, TripSummary, check_calibration, check_named_files, close,
};
