//! The summary of a run, in the output of every command and in the recording.

use serde::Serialize;

use crate::analysis::Ending;
use crate::live::{Run, StopCause};
use crate::plan::Description;
use bench_recording::{Quantiles, RecordingError};
use bench_rt::arming::Trip;
use bench_rt::thread::{Pace, Scheduling};

/// Counts, timing and ending of a run.
#[derive(Clone, Debug, Serialize)]
pub struct RunSummary {
    /// Name, note and operator.
    #[serde(flatten)]
    pub description: Description,
    /// How the run ended.
    pub outcome: Ending,
    /// Why it was stopped early.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stop_cause: Option<StopCause>,
    /// Why it is not recorded to its end.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unrecorded: Option<StopCause>,
    /// The trip that ended it.
    pub trip: Option<TripSummary>,
    /// Recorded ticks.
    pub ticks: u64,
    /// Scheduled ticks that were not served.
    pub overruns: u64,
    /// Records lost between loop and recording.
    pub lost_records: u64,
    /// Path of the recording.
    pub recording: String,
    /// Equal for two runs whose loops had the same input and output, bit for bit.
    pub loop_digest: String,
    /// The thermal current of the motor at start and end.
    pub motor: MotorRun,
    /// Pace, scheduling and timing of the loop.
    pub timing: TimingSummary,
}

/// The thermal current of the motor at the start and at the end of a run.
#[derive(Clone, Debug, Serialize)]
pub struct MotorRun {
    /// At the start, in amperes.
    pub thermal_start_a: f64,
    /// At the end, in amperes.
    pub thermal_end_a: f64,
    /// How the state at the start was known.
    pub known_from: String,
}

/// A trip of the interlocks.
#[derive(Clone, Debug, Serialize)]
pub struct TripSummary {
    /// Short name of the reason.
    pub reason: &'static str,
    /// The tick of the trip.
    pub tick: u64,
    /// The reason with value and limit.
    pub text: String,
    /// What to do about it.
    pub remedy: &'static str,
}

/// Timing of a loop.
#[derive(Clone, Debug, Serialize)]
pub struct TimingSummary {
    /// Pace of the loop.
    pub pace: Pace,
    /// How its thread was scheduled.
    #[serde(flatten)]
    pub scheduling: Scheduling,
    /// Time at which the loop woke up minus time at which the tick was due.
    pub lateness_ns: Quantiles,
    /// Time from waking up to the written command.
    pub compute_ns: Quantiles,
}

impl TripSummary {
    /// The trip of a run, if it ended with one.
    pub fn of(ending: Ending) -> Option<TripSummary> {
        ending.trip().map(|(trip, tick)| summary(trip, tick))
    }
}

fn summary(trip: Trip, tick: u64) -> TripSummary {
    TripSummary {
        reason: trip.reason(),
        tick,
        text: trip.to_string(),
        remedy: trip.remedy(),
    }
}

impl RunSummary {
    /// Summarises a run; its recording then contains every tick.
    pub fn of(run: &mut Run) -> Result<RunSummary, RecordingError> {
        let totals = run.totals()?;
        let ending = Ending::from(&run.end.servo);
        Ok(RunSummary {
            description: run.end.description.clone(),
            outcome: ending,
            stop_cause: run.end.stop_cause,
            unrecorded: run.end.unrecorded,
            trip: TripSummary::of(ending),
            ticks: totals.ticks,
            overruns: totals.overruns,
            // Records lost at the very end leave no gap in the file; only the loop counts them.
            lost_records: totals.lost_records.max(run.end.servo.lost_records),
            recording: run.path.display().to_string(),
            loop_digest: format!("{:016x}", totals.loop_digest),
            motor: MotorRun {
                thermal_start_a: run.end.motor.thermal_a2.sqrt(),
                thermal_end_a: run.end.servo.thermal_a2.sqrt(),
                known_from: run.end.motor.known_from.clone(),
            },
            timing: TimingSummary {
                pace: run.end.pace,
                scheduling: run.end.scheduling.clone(),
                lateness_ns: totals.lateness,
                compute_ns: totals.compute,
            },
        })
    }

    /// Whether the run was completed.
    pub fn is_completed(&self) -> bool {
        self.outcome == Ending::Completed
    }

    /// Whether ticks were not served or records were lost.
    pub fn has_losses(&self) -> bool {
        self.overruns + self.lost_records > 0
    }
}
