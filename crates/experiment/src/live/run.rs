//! A run that has ended, and why a run was stopped.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::plan::{Description, MotorStart};
use bench_recording::{Recorder, RecordingError, Shortage, Totals};
use bench_rt::record::Origin;
use bench_rt::servo_run::ServoEnd;
use bench_rt::thread::{Pace, Scheduling};

/// A run that has ended; results can still be added to its recording.
pub struct Run {
    /// Path of the recording.
    pub path: PathBuf,
    /// What the process that owns the rig knows of it.
    pub end: RunEnd,
    pub(crate) file: RunFile,
}

/// How a run was made and how it ended.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunEnd {
    /// Its name, note and operator.
    #[serde(default)]
    pub description: Description,
    /// How it ended.
    pub servo: ServoEnd,
    /// Pace of the loop.
    pub pace: Pace,
    /// How the loop was scheduled.
    pub scheduling: Scheduling,
    /// Why it was stopped early; `None` if it was not.
    pub stop_cause: Option<StopCause>,
    /// Why it is not recorded to its end; `None` if it is.
    pub unrecorded: Option<StopCause>,
    /// The thermal state of the motor at its start.
    pub motor: MotorStart,
}

/// The open recording of a run.
pub(crate) enum RunFile {
    /// Of this process.
    Own(Box<Recorder>),
    /// Of the process that owns the rig.
    Remote {
        /// Its counts, which contain all ticks.
        totals: Totals,
        recording: Box<dyn RemoteRecording>,
    },
}

/// An open recording of the process that owns the rig. Dropping it completes the file without results.
pub trait RemoteRecording: Send {
    /// Adds the results and closes the file.
    ///
    /// # Errors
    /// When the file cannot be written, or the owner cannot be reached.
    fn finish(self: Box<Self>, results_json: &str) -> Result<Totals, RecordingError>;
}

impl Run {
    /// Counts of the recording, which contains all ticks by now. Fails if the file was removed during the run.
    pub fn totals(&mut self) -> Result<Totals, RecordingError> {
        let totals = match &mut self.file {
            RunFile::Own(recorder) => recorder.complete()?,
            RunFile::Remote { totals, .. } => totals.clone(),
        };
        if self.path.exists() {
            Ok(totals)
        } else {
            Err(RecordingError::Removed {
                path: self.path.clone(),
            })
        }
    }

    /// Adds the results and closes the file.
    pub fn finish(self, results_json: &str) -> Result<Totals, RecordingError> {
        let results = ("results.json", "application/json", results_json.as_bytes());
        match self.file {
            RunFile::Own(recorder) => recorder.finish(&[results]),
            RunFile::Remote { recording, .. } => recording.finish(results_json),
        }
    }
}

/// Why a run was stopped before its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StopCause {
    /// A signal of the operator or of the system.
    Signal,
    /// The loop itself: the supervisor did not renew the arm lease.
    LeaseExpired,
    /// The recording could not be written.
    RecordingFailed,
    /// No tick was recorded for one second: the disk is too slow.
    RecordsLost,
    /// The disk of the recording had little free space.
    DiskNearlyFull,
    /// The recording was much larger than the plan predicts.
    RecordingTooLarge,
}

impl From<Shortage> for StopCause {
    fn from(shortage: Shortage) -> StopCause {
        match shortage {
            Shortage::DiskNearlyFull => StopCause::DiskNearlyFull,
            Shortage::TooLarge => StopCause::RecordingTooLarge,
        }
    }
}

impl StopCause {
    /// Description, with the remedy if nobody stopped the run on purpose.
    pub fn text(self) -> &'static str {
        match self {
            StopCause::Signal => "a signal",
            StopCause::LeaseExpired => "the command line did not respond",
            StopCause::RecordingFailed => {
                "the recording could not be written; check its disk, and complete what was written with `bench recover`"
            }
            StopCause::RecordsLost => {
                "no tick was recorded for 1 s, because the disk is too slow; record on another disk with --out"
            }
            StopCause::DiskNearlyFull => {
                "the disk of the recording had less than 100 MB of free space; free some space, or record to another disk with --out"
            }
            StopCause::RecordingTooLarge => {
                "the recording was more than 10 times as large as the plan predicts; report this with the recording"
            }
        }
    }

    /// Why the loop ended a run at the request of `origin`. The supervisor knows the reasons of its own requests.
    pub(crate) fn by(origin: Origin) -> Option<StopCause> {
        match origin {
            Origin::Supervisor => None,
            Origin::Signal => Some(StopCause::Signal),
            Origin::Lease => Some(StopCause::LeaseExpired),
        }
    }
}
