//! The real-time loop.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Arm lease without a setting in seconds.
const DEFAULT_ARM_LEASE_S: f64 = 2.0;
/// Time for which the loop waits awake for a tick, without a setting, in seconds: more than nearly every wake-up of a thread with
/// SCHED_FIFO takes (p99 of `cyclictest` 40 us to 60 us).
const DEFAULT_WAKE_EARLY_S: f64 = 80e-6;
/// Largest share of a period for which the loop waits awake.
const MAX_AWAKE_SHARE: f64 = 0.4;

/// What happens to a run that cannot be recorded any more, because the disk is full, too slow, or fails.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum OnRecordingFailure {
    /// It ends along the ramp of a normal stop.
    #[default]
    End,
    /// It goes on without a recording.
    Continue,
}

/// The real-time loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LoopSettings {
    /// Servo rate in ticks per second.
    #[schemars(range(min = 1.0, max = 100000.0))]
    pub rate_hz: f64,
    /// Whole periods from a measurement to the time at which its command takes effect. With real devices 0 or 1: at 0 a command
    /// is sent in the tick in which it is computed, at 1 in the next one.
    #[schemars(range(min = 0, max = 8))]
    pub computing_delay_periods: u32,
    /// SCHED_FIFO priority of the thread of the loop, at real-time pace.
    #[schemars(range(min = 1, max = 98))]
    pub priority: i32,
    /// Processor to which the thread of the loop is bound; if absent, the scheduler chooses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0, max = 1023))]
    pub cpu: Option<usize>,
    /// Length of each of the two ramps to zero current at the end of a run, in seconds; 0 switches the current off in one
    /// step. If absent: three periods of the first mode of the model, at most 2 s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 60.0))]
    pub stop_ramp_s: Option<f64>,
    /// Time for which the readings are judged before the amplifier is enabled, in seconds. If absent: 0.02 s at real-time pace,
    /// one tick at virtual pace.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 10.0))]
    pub healthy_s: Option<f64>,
    /// Time in seconds after which the loop ends a run at real-time pace by itself, because the command line does not respond; 2
    /// if absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.1, max = 60.0))]
    pub arm_lease_s: Option<f64>,
    /// Time in seconds by which the thread of the loop wakes before a tick at real-time pace; it then waits awake, so that the
    /// tick does not contain the time that the system takes to wake a thread. At most 40 % of a period is used. 80 us if absent;
    /// 0 sleeps up to the tick.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 0.0, max = 0.001))]
    pub wake_early_s: Option<f64>,
    /// What happens to a run that cannot be recorded any more, because the disk is full, too slow, or fails: "end" (the default)
    /// ends it along the ramp of a normal stop, "continue" lets it go on without a recording.
    #[serde(default)]
    pub on_recording_failure: OnRecordingFailure,
}

impl LoopSettings {
    /// Length of a tick in seconds.
    pub fn period_s(&self) -> f64 {
        1.0 / self.rate_hz
    }

    /// Time in seconds for which the loop waits awake for a tick.
    pub fn awake_s(&self) -> f64 {
        let wanted_s = self.wake_early_s.unwrap_or(DEFAULT_WAKE_EARLY_S);
        wanted_s.min(MAX_AWAKE_SHARE * self.period_s())
    }

    /// Time in seconds after which a run ends whose arm lease was not renewed.
    pub fn arm_lease_s(&self) -> f64 {
        self.arm_lease_s.unwrap_or(DEFAULT_ARM_LEASE_S)
    }

    /// Time in ticks after which a run ends whose arm lease was not renewed.
    pub fn arm_lease_ticks(&self) -> u64 {
        (self.arm_lease_s() * self.rate_hz).ceil() as u64
    }
}
