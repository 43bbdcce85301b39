//! The shots of a sequence, its limits and its end. The names in JSON must not change.

use std::sync::atomic::AtomicBool;

use serde::Serialize;

use super::shot::Shot;
use bench_identify::verdict::Cnmp;

/// A shot with the verdict of all data up to it.
#[derive(Clone, Debug, Serialize)]
pub struct ShotSummary {
    /// Band and length.
    #[serde(flatten)]
    pub shot: Shot,
    /// Its recording.
    pub recording: String,
    /// Scheduled ticks that were not served.
    pub overruns: u64,
    /// Records lost between loop and recording.
    pub lost_records: u64,
    /// The verdict of this and all earlier shots.
    pub cnmp: Cnmp,
    /// The reasons.
    pub why: String,
}

impl ShotSummary {
    /// Whether ticks were not served or records were lost.
    pub fn has_losses(&self) -> bool {
        self.overruns + self.lost_records > 0
    }
}

/// Why a sequence ended.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case", tag = "end")]
pub enum SequenceEnd {
    /// The verdict is certain.
    Decided,
    /// The motion reached its limit.
    LimitReached,
    /// The number of shots reached [`MAX_LOOKS`](bench_identify::verdict::MAX_LOOKS).
    ChirpLimitReached,
    /// More motion is predicted to be necessary than is allowed.
    NeedsMoreMotion {
        /// The predicted motion in seconds.
        needed_s: f64,
    },
    /// The model has fewer modes with a residue than a verdict needs, and all of them are found.
    Undecidable,
    /// A run was stopped or tripped, or the sequence was stopped between two runs.
    Interrupted,
}

/// What ends a sequence before the verdict is certain.
#[derive(Clone, Copy, Debug)]
pub struct SequenceLimits<'a> {
    /// Largest length of all sweeps in seconds.
    pub max_motion_s: f64,
    /// When it is set, no other shot begins.
    pub stop: &'a AtomicBool,
}

/// Length of all sweeps in seconds.
pub(super) fn motion_s(shots: &[ShotSummary]) -> f64 {
    let lengths = shots.iter().map(|shot| shot.shot.duration_s);
    lengths.fold(0.0, |sum, length| sum + length)
}
