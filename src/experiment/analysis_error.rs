//! Why a recording cannot be analysed.

use super::plan_error::PlanError;
use crate::control::ControllerError;
use crate::identify::IdentifyError;
use crate::model::plant::PlantError;
use crate::recording::RecordingError;

/// Why a recording gives no frequency response.
#[derive(Debug, thiserror::Error)]
pub enum AnalysisError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The signals allow no estimate.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The model cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// A closed loop whose controller is not known, or whose reference did not sweep.
    #[error(transparent)]
    Loop(#[from] ClosedLoopError),
    /// No program ran.
    #[error("no program ran in this recording: there is no excitation to analyse")]
    NothingRan,
    /// The receiver of the progress cancelled the analysis.
    #[error("the analysis was cancelled")]
    Cancelled,
    /// Too many ticks are missing.
    #[error(
        "{missing} ticks or more are missing beside the {ticks} that were recorded, {allowed} may be filled in; repeat the run at a rate the machine keeps, or in real-time scheduling"
    )]
    Gaps {
        /// Missing ticks, up to where there were too many.
        missing: u64,
        /// Recorded ones.
        ticks: u64,
        /// Ticks that may be missing.
        allowed: u64,
    },
}

/// A recording of a closed loop that shows no plant.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ClosedLoopError {
    /// The reference stayed where it was, or was a single sine or step.
    #[error(
        "the reference of this recording, {kind}, does not sweep the band of [chirp]; repeat the run with `bench control --reference chirp`"
    )]
    Reference {
        /// Its kind.
        kind: &'static str,
    },
    /// The recording does not say what ran.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// Its controller is not one.
    #[error(transparent)]
    Controller(#[from] ControllerError),
}
