//! What belongs to one run of the loop: its program, its interlocks, its rings and its supervision. It is made outside the loop,
//! passed to it as a whole, and returned at the end of the run.

use std::sync::Arc;
use std::sync::atomic::AtomicU64;

use rtrb::{Consumer, Producer};
use serde::{Deserialize, Serialize};

use super::arming::Trip;
use super::device_defect::DefectCell;
use super::interlock::Interlocks;
use super::program::Program;
use super::publisher::Publisher;
use super::record::Origin;
use super::request::NumberedRequest;
use super::settling::Settling;
use super::supervision::{LeaseWatch, StopFlags, Supervision};
use super::tuning::Tuning;
use bench_rig::calibration::Correction;

/// Progress of a running loop, for other threads.
#[derive(Debug, Default)]
pub struct Progress {
    /// Ticks of the program done so far.
    pub run_ticks: AtomicU64,
    /// Ticks without a record since the last recorded one.
    pub unrecorded_ticks: AtomicU64,
    /// Whether the devices can be used.
    pub defect: DefectCell,
}

/// The loop's ends of the rings.
pub struct Connections {
    /// Requests of the supervisor.
    pub requests: Consumer<NumberedRequest>,
    /// Programs that ended, to be freed outside the loop.
    pub retired: Producer<Box<dyn Program>>,
    /// Publishes records and events to the recorder.
    pub publisher: Publisher,
    /// Progress for other threads.
    pub progress: Arc<Progress>,
}

/// One run of the loop.
pub struct ServoRun {
    pub(super) correction: Option<Correction>,
    pub(super) interlocks: Interlocks,
    pub(super) program: Option<Box<dyn Program>>,
    /// Tick of the program.
    pub(super) program_tick: u64,
    /// Length of each of the two ramps to zero current in ticks; without ramps if 0.
    pub(super) ramp_ticks: u64,
    pub(super) settling: Settling,
    pub(super) tuning: Tuning,
    pub(super) supervision: Supervision,
    pub(super) stopped_by: Option<Origin>,
    /// Current in amperes that the program requested in the last tick.
    pub(super) requested_a: f64,
    /// Current in amperes that the amplifier gives since the last tick.
    pub(super) applied_a: f64,
    /// The same current as set-point of the amplifier, before the correction.
    pub(super) raw_command_a: f64,
    pub(super) connections: Connections,
    pub(super) trip: Option<(Trip, u64)>,
    pub(super) completed: bool,
    /// When the clocks are published next, in nanoseconds since the run started.
    pub(super) clocks_due_ns: u64,
    pub(super) enabling: Enabling,
    /// Ticks after the amplifier was switched off.
    tail_ticks: u64,
}

/// Progress of [`State::Enabling`](super::arming::State::Enabling).
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Enabling {
    /// Healthy ticks that are required before the amplifier is enabled.
    pub(super) required_ticks: u64,
    /// Healthy ticks since the request to arm.
    pub(super) healthy_ticks: u64,
    /// Whether the amplifier is being enabled.
    pub(super) has_begun: bool,
}

/// How a run ended.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct ServoEnd {
    /// The trip, if there was one, and its tick.
    pub trip: Option<(Trip, u64)>,
    /// Whether the program ran to its end.
    pub completed: bool,
    /// Who ended the run early without a request of the supervisor: a signal or the arm lease.
    pub stopped_by: Option<Origin>,
    /// Records that did not fit into the ring.
    pub lost_records: u64,
    /// The thermal state of the motor at the end, in A^2.
    pub thermal_a2: f64,
}

impl ServoRun {
    /// Its time begins at 0 again: the clocks of the system are published at its next tick.
    pub(super) fn restart_clocks(&mut self) {
        self.clocks_due_ns = 0;
    }

    /// A run without a program: it comes with a request.
    pub fn new(interlocks: Interlocks, connections: Connections) -> Self {
        ServoRun {
            correction: None,
            interlocks,
            program: None,
            program_tick: 0,
            ramp_ticks: 0,
            settling: Settling::new(0),
            tuning: Tuning::default(),
            supervision: Supervision::default(),
            stopped_by: None,
            requested_a: 0.0,
            applied_a: 0.0,
            raw_command_a: 0.0,
            connections,
            trip: None,
            completed: false,
            clocks_due_ns: 0,
            enabling: Enabling::default(),
            tail_ticks: 0,
        }
    }

    /// With the correction of a calibration. The interlocks judge readings and set-points before and after it.
    pub fn with_correction(mut self, correction: Option<Correction>) -> Self {
        self.correction = correction;
        self
    }

    /// With ramps of `ramp_ticks` at the end of the run (see [`settling`](super::settling)). Without them the current goes to zero
    /// in one step.
    pub fn with_ramps(mut self, ramp_ticks: u64) -> Self {
        self.ramp_ticks = ramp_ticks;
        self
    }

    /// With `ticks` healthy ticks between the request to arm and the enabling of the amplifier. A tick is healthy if no interlock
    /// would trip in it. The first tick is always judged before the amplifier is enabled.
    pub fn with_healthy_ticks(mut self, ticks: u64) -> Self {
        self.enabling.required_ticks = ticks;
        self
    }

    /// With `ticks` after the amplifier was switched off, before the run ends.
    pub fn with_tail(mut self, ticks: u64) -> Self {
        self.tail_ticks = ticks;
        self
    }

    /// With the flags that signals set.
    pub fn with_stop_flags(mut self, flags: StopFlags) -> Self {
        self.supervision.flags = flags;
        self
    }

    /// With an arm lease, if there is one. When it expires, the loop ends the run along a ramp.
    pub fn with_lease(mut self, lease: Option<LeaseWatch>) -> Self {
        self.supervision.lease = lease;
        self
    }

    /// How the run ended.
    pub fn outcome(&self) -> ServoEnd {
        ServoEnd {
            trip: self.trip,
            completed: self.completed,
            stopped_by: self.stopped_by,
            lost_records: self.connections.publisher.lost(),
            thermal_a2: self.interlocks.thermal_a2(),
        }
    }

    /// Ticks after the amplifier was switched off, before the run ends.
    pub fn tail_ticks(&self) -> u64 {
        self.tail_ticks
    }

    /// The connection to the recorder.
    pub fn publisher(&self) -> &Publisher {
        &self.connections.publisher
    }
}
