//! Why a recording cannot be analysed.

use crate::plan::PlanError;
use bench_control::ControllerError;
use bench_control::measured::MeasuredLoopError;
use bench_excitation::ExcitationError;
use bench_identify::{IdentificationError, IdentifyError};
use bench_plant::PlantError;
use bench_recording::RecordingError;

/// Why a recording gives no frequency response.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AnalysisError {
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The signals allow no estimate.
    #[error(transparent)]
    Identify(#[from] IdentifyError),
    /// The signals cannot be identified.
    #[error(transparent)]
    Identification(#[from] IdentificationError),
    /// The model cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The controller of a closed loop is not known, or its reference did not sweep the band.
    #[error(transparent)]
    Loop(#[from] ClosedLoopError),
    /// The excitation has no settings.
    #[error(transparent)]
    Excitation(#[from] ExcitationError),
    /// No program ran.
    #[error(
        "no program ran in this recording, so it contains no excitation to analyse; choose another recording"
    )]
    NothingRan,
    /// A sweep ended before it excited a band.
    #[error(
        "the sweep ended at {reached_hz:.2} Hz soon after its start at {from_hz} Hz, too early for a frequency response; repeat the run"
    )]
    EndedTooEarly {
        /// First frequency of the sweep.
        from_hz: f64,
        /// The frequency at its end.
        reached_hz: f64,
    },
    /// The receiver of the progress cancelled the analysis.
    #[error("the analysis was cancelled; repeat it with `bench identify`")]
    Cancelled,
    /// A reading that is older than any loop uses.
    #[error(
        "the reading of tick {tick} is {age_s:.3e} s old, but at most {limit_s} s are possible, so the recording was altered; record again"
    )]
    ReadingAge {
        /// The tick.
        tick: u64,
        /// Age of its reading in seconds.
        age_s: f64,
        /// Largest age in seconds.
        limit_s: f64,
    },
    /// Too many ticks are missing.
    #[error(
        "{missing} ticks are missing between the {ticks} recorded ones, but at most {allowed} can be replaced; repeat the run with real-time priority (docs/real-time.md) or a lower loop.rate_hz"
    )]
    Gaps {
        /// Missing ticks.
        missing: u64,
        /// Recorded ticks.
        ticks: u64,
        /// Number of ticks that can be replaced.
        allowed: u64,
    },
    /// Too many records are lost.
    #[error(
        "{lost} records are lost between the {ticks} recorded ticks, but at most {allowed} can be replaced, because the current in their ticks is not known; repeat the run"
    )]
    LostRecords {
        /// Lost records.
        lost: u64,
        /// Recorded ticks.
        ticks: u64,
        /// Number of records that can be replaced.
        allowed: u64,
    },
    /// Too many ticks are missing in the time in which the sweep determines a mode.
    #[error(
        "{missing} of {window} successive ticks are missing ({all} in the whole run), more than half, so that a mode there is not determined; repeat the run with real-time priority (docs/real-time.md), a lower loop.rate_hz or a larger chirp.duration_s"
    )]
    DenseGaps {
        /// Missing ticks among them.
        missing: u64,
        /// Number of successive ticks.
        window: u64,
        /// Missing ticks of the run.
        all: u64,
    },
}

/// A closed-loop recording from which the plant cannot be estimated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ClosedLoopError {
    /// The reference did not sweep the band: it was constant, a step, or a single sine.
    #[error(
        "the reference of this recording, {kind}, does not sweep the band of [chirp]; repeat the run with `bench control --reference chirp`"
    )]
    Reference {
        /// Kind of the reference.
        kind: &'static str,
    },
    /// The recording does not contain the plan of the run.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The recorded controller is invalid.
    #[error(transparent)]
    Controller(#[from] ControllerError),
    /// The measured loop gives no margins.
    #[error(transparent)]
    Margins(#[from] MeasuredLoopError),
}
