//! Rig and clock of a recording.

use std::task::Poll;

use bench_hal::{AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, Reading, Tick};
use rtrb::{Consumer, Producer, RingBuffer};

use bench_rig::calibration::Correction;
use bench_rt::clock::{Clock, TickTiming};
use bench_rt::publisher::Publisher;
use bench_rt::record::{TickRecord, flag};

/// The record of a tick, and whether the amplifier caused a trip in it.
#[derive(Clone, Copy, Default)]
pub(super) struct RecordedTick {
    pub(super) record: TickRecord,
    /// The amplifier reported a fault or itself disabled, refused the command, or returned another value than expected.
    pub(super) amplifier_tripped: bool,
}

/// Returns the recorded probe readings, and accepts or rejects commands like the recorded amplifier.
pub(super) struct RecordedRig {
    now: RecordedTick,
    correction: Option<Correction>,
    ticks: Consumer<RecordedTick>,
    enables: Consumer<bool>,
    clears: Consumer<()>,
    status: AmplifierStatus,
}

/// The queues that determine the next actions of a [`RecordedRig`]. The rig takes each entry within the tick for
/// which it is pushed.
pub(super) struct RigFeed {
    /// The tick.
    pub(super) ticks: Producer<RecordedTick>,
    /// Whether the amplifier accepts to be enabled.
    pub(super) enables: Producer<bool>,
    /// One entry for each accepted reset of a fault.
    pub(super) clears: Producer<()>,
}

/// The ring of a replay must hold everything that happens in one tick.
const SLOTS: usize = 64;

const REFUSED: DeviceError = DeviceError {
    what: "the amplifier refused, as recorded",
    remedy: "see the events of the recording",
    code: 0,
};

impl RecordedRig {
    /// A disabled rig, and its feed. `correction` is that of the loop.
    pub(super) fn new(correction: Option<Correction>) -> (RecordedRig, RigFeed) {
        let (to_rig, ticks) = RingBuffer::new(SLOTS);
        let (enabled, enables) = RingBuffer::new(SLOTS);
        let (cleared, clears) = RingBuffer::new(SLOTS);
        let rig = RecordedRig {
            now: RecordedTick::default(),
            correction,
            ticks,
            enables,
            clears,
            status: AmplifierStatus::Disabled,
        };
        let feed = RigFeed {
            ticks: to_rig,
            enables: enabled,
            clears: cleared,
        };
        (rig, feed)
    }
}

impl CurrentAmplifier for RecordedRig {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    /// Ready in the tick in which the recorded amplifier was enabled.
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        match self.enables.pop() {
            Ok(true) => {
                self.status = AmplifierStatus::Enabled;
                Poll::Ready(Ok(()))
            }
            Ok(false) => Poll::Ready(Err(REFUSED)),
            Err(_) => Poll::Pending,
        }
    }

    /// Returns the recorded command for the recorded request. Another request is returned unchanged; the comparison
    /// detects it.
    fn command(&mut self, set_point_a: f64) -> Result<f64, DeviceError> {
        if self.now.amplifier_tripped {
            return Err(REFUSED);
        }
        let record = &self.now.record;
        let recorded_a = match self.correction {
            None => record.requested_a,
            Some(correction) => correction.set_point_a(record.requested_a),
        };
        let accepted_a = record.raw_command_a.unwrap_or(record.command_a);
        let is_same = set_point_a.to_bits() == recorded_a.to_bits();
        Ok(if is_same { accepted_a } else { set_point_a })
    }

    fn disable(&mut self) {
        self.status = AmplifierStatus::Disabled;
    }

    fn actual_current_a(&self) -> Option<f64> {
        self.now.record.actual_a
    }

    /// Ready in the tick in which the recorded trip was cleared.
    fn poll_reset(&mut self) -> Poll<Result<(), DeviceError>> {
        match self.clears.pop() {
            Ok(()) => Poll::Ready(Ok(())),
            Err(_) => Poll::Pending,
        }
    }

    /// After a fault the loop does not request a command from the program. If the record contains a command, this
    /// command failed.
    fn status(&self) -> AmplifierStatus {
        let record = &self.now.record;
        let has_command = record.requested_a.to_bits() | record.reference_m.to_bits() != 0
            || record.flags & flag::ACTIVE != 0;
        if self.now.amplifier_tripped && !has_command {
            AmplifierStatus::Fault(0)
        } else {
            self.status
        }
    }
}

impl DisplacementProbe for RecordedRig {
    fn latest(&mut self, _now: Tick) -> Reading {
        if let Ok(tick) = self.ticks.pop() {
            self.now = tick;
        }
        let record = &self.now.record;
        Reading {
            position_m: record.raw_position_m.unwrap_or(record.position_m),
            sequence: record.probe_sequence,
            age_ns: record.probe_age_ns,
            validity: record.validity,
        }
    }
}

/// The clock of a recorded tick: now is the recorded end of the tick, in nanoseconds.
pub(super) struct RecordedClock(pub(super) u64);

impl Clock for RecordedClock {
    fn wait(&mut self, number: u64, _outlet: &Publisher) -> TickTiming {
        TickTiming {
            tick: Tick {
                number,
                scheduled_ns: 0,
            },
            woke_ns: 0,
            missed: 0,
        }
    }

    fn now_ns(&self, _tick: Tick) -> u64 {
        self.0
    }
}
