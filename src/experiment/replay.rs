//! The recorded probe through the same loop.
//!
//! Rig and clock are those of the recording: every reading, every moment, every order at its tick. What the loop decides
//! from them must be what it decided then, bit for bit. What the amplifier did stands in the trips that it caused.

use std::iter::Peekable;
use std::sync::Arc;

use bench_hal::{AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, Reading, Tick};
use rtrb::{Consumer, Producer, RingBuffer};

use super::plan::Plan;
use super::plan_error::PlanError;
use crate::recording::{Recording, RecordingError};
use crate::rt::arming::{State, Trip};
use crate::rt::clock::{Clock, TickTiming};
use crate::rt::interlock::Interlocks;
use crate::rt::program::Program;
use crate::rt::publisher::{Publisher, SLOTS_PER_TICK};
use crate::rt::record::{Event, EventKind, LoopMessage, RequestKind, TickRecord, flag};
use crate::rt::servo::{Connections, Progress, Request, Servo};

/// A recording that cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// No plan can be made from it.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// It cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// It has gaps: what the loop saw there is not known.
    #[error(
        "{lost} records are missing from the recording, the first after tick {after}: what the loop saw there is not known, so nothing after it can be replayed"
    )]
    Gap {
        /// How many.
        lost: u64,
        /// Last tick before the first gap.
        after: u64,
    },
}

/// A tick at which the replay differs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// Which tick.
    pub tick: u64,
    /// What the amplifier was told then.
    pub recorded_a: f64,
    /// What it would be told now.
    pub replayed_a: f64,
}

/// What a replay showed.
#[derive(Clone, Debug, PartialEq)]
pub struct Replayed {
    /// Ticks compared.
    pub ticks: u64,
    /// Ticks that differ in command, request, reference, state or flags.
    pub different: u64,
    /// The first of them.
    pub first: Option<Difference>,
}

/// Replays a recording.
pub fn replay(recording: &Recording) -> Result<Replayed, ReplayError> {
    if let Some(gap) = recording.gaps().iter().find(|gap| gap.lost > 0) {
        return Err(ReplayError::Gap {
            lost: recording.lost_records(),
            after: gap.after_tick,
        });
    }
    let plan = Plan::of(recording)?;
    let (published, records) = RingBuffer::new(64);
    let (requests, taken) = RingBuffer::new(64);
    let (retired, collected) = RingBuffer::new(64);
    let connections = Connections {
        requests: taken,
        retired,
        publisher: Publisher::new(published),
        progress: Arc::new(Progress::default()),
    };
    let (to_rig, seen) = RingBuffer::new(4);
    let (enabled, enables) = RingBuffer::new(64);
    let (cleared, clears) = RingBuffer::new(64);
    let rig = Box::new(RecordedRig {
        now: Seen::default(),
        seen,
        enables,
        clears,
        status: AmplifierStatus::Disabled,
    });
    let config = &plan.config;
    let interlocks = Interlocks::new(&config.interlock, &config.motor, &config.servo);
    let servo = Servo::new(rig, interlocks, connections);
    let program = plan.program()?;
    let mut comparison = Comparison {
        servo,
        requests,
        to_rig,
        enabled,
        cleared,
        records,
        collected,
        program: Some(program),
        replayed: Replayed {
            ticks: 0,
            different: 0,
            first: None,
        },
    };
    let mut events = recording.events().iter().peekable();
    for record in recording.ticks()? {
        let record = record?;
        let amplifier_tripped = comparison.take(&mut events, record.tick);
        comparison.tick(&Seen {
            record,
            amplifier_tripped,
        });
    }
    Ok(comparison.replayed)
}

struct Comparison {
    servo: Servo,
    requests: Producer<Request>,
    to_rig: Producer<Seen>,
    enabled: Producer<bool>,
    cleared: Producer<()>,
    records: Consumer<LoopMessage>,
    collected: Consumer<Box<dyn Program>>,
    program: Option<Box<dyn Program>>,
    replayed: Replayed,
}

/// What rig and amplifier did in a tick.
#[derive(Clone, Copy, Default)]
struct Seen {
    record: TickRecord,
    /// The amplifier reported a fault, refused the command or gave nonsense.
    amplifier_tripped: bool,
}

impl Comparison {
    /// The events up to a tick: requests for the loop, and what the amplifier did; whether it made the loop trip.
    fn take<'a>(
        &mut self,
        events: &mut Peekable<impl Iterator<Item = &'a Event>>,
        tick: u64,
    ) -> bool {
        let of_amplifier =
            |event: &Event| matches!(event.kind, EventKind::Trip(Trip::Amplifier { .. }));
        let mut tripped = false;
        while let Some(event) = events.next_if(|event| event.tick <= tick) {
            match event.kind {
                EventKind::Request(kind) => self.order(kind),
                EventKind::State {
                    from: State::Disarmed,
                    to: State::Armed,
                } => {
                    let refused = events
                        .next_if(|next| next.tick == event.tick && of_amplifier(next))
                        .is_some();
                    // The rig takes it within this very tick.
                    let _ = self.enabled.push(!refused);
                }
                EventKind::State {
                    from: State::Tripped,
                    to: State::Disarmed,
                } => {
                    // As above.
                    let _ = self.cleared.push(());
                }
                _ => tripped |= of_amplifier(event),
            }
        }
        tripped
    }

    fn order(&mut self, kind: RequestKind) {
        let order = match kind {
            RequestKind::Arm => Some(Request::Arm),
            RequestKind::Start => self.program.take().map(Request::Start),
            RequestKind::Stop => Some(Request::Stop),
            RequestKind::Clear => Some(Request::Clear),
        };
        // The loop empties its ring at every tick.
        let _ = order.map(|order| self.requests.push(order));
    }

    fn tick(&mut self, seen: &Seen) {
        let recorded = &seen.record;
        let tick = Tick {
            number: recorded.tick,
            scheduled_ns: recorded.scheduled_ns,
        };
        let moment = TickTiming {
            tick,
            woke_ns: recorded.woke_ns,
            missed: recorded.missed_ticks,
        };
        // The rig takes its record within this very tick.
        let _ = self.to_rig.push(*seen);
        self.servo.tick(&moment, &RecordedClock(recorded.done_ns));
        while self.collected.pop().is_ok() {}
        while let Ok(published) = self.records.pop() {
            if let LoopMessage::Tick(now) = published {
                self.compare(recorded, &now);
            }
        }
    }

    fn compare(&mut self, recorded: &TickRecord, now: &TickRecord) {
        let bits = |r: &TickRecord| [r.command_a, r.requested_a, r.reference_m].map(f64::to_bits);
        self.replayed.ticks += 1;
        if bits(recorded) != bits(now) || (recorded.state, recorded.flags) != (now.state, now.flags)
        {
            self.replayed.different += 1;
            let difference = Difference {
                tick: now.tick,
                recorded_a: recorded.command_a,
                replayed_a: now.command_a,
            };
            self.replayed.first.get_or_insert(difference);
        }
    }
}

/// Returns the recorded probe readings, and accepts or rejects commands like the recorded amplifier.
struct RecordedRig {
    now: Seen,
    seen: Consumer<Seen>,
    /// Whether the amplifier could be enabled, time after time.
    enables: Consumer<bool>,
    /// A clear for each that the amplifier took.
    clears: Consumer<()>,
    status: AmplifierStatus,
}

const REFUSED: DeviceError = DeviceError {
    what: "the amplifier refused, as recorded",
    remedy: "see the recording's events",
    code: 0,
};

impl CurrentAmplifier for RecordedRig {
    fn enable(&mut self) -> Result<(), DeviceError> {
        if self.enables.pop() == Ok(false) {
            return Err(REFUSED);
        }
        self.status = AmplifierStatus::Enabled;
        Ok(())
    }

    /// The same request is answered as it was then; another one is given as it is, which the comparison will show.
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        if self.now.amplifier_tripped {
            return Err(REFUSED);
        }
        let record = &self.now.record;
        let same = current_a.to_bits() == record.requested_a.to_bits();
        Ok(if same { record.command_a } else { current_a })
    }

    fn disable(&mut self) {
        self.status = AmplifierStatus::Disabled;
    }

    fn actual_current_a(&self) -> Option<f64> {
        self.now.record.actual_a
    }

    fn reset_fault(&mut self) -> Result<(), DeviceError> {
        self.clears.pop().map_err(|_| REFUSED)
    }

    /// A fault keeps the program from deciding anything; where something was decided, it was the command that failed.
    fn status(&self) -> AmplifierStatus {
        let record = &self.now.record;
        let decided = record.requested_a.to_bits() | record.reference_m.to_bits() != 0
            || record.flags & flag::ACTIVE != 0;
        if self.now.amplifier_tripped && !decided {
            AmplifierStatus::Fault(0)
        } else {
            self.status
        }
    }
}

impl DisplacementProbe for RecordedRig {
    fn latest(&mut self, _now: Tick) -> Reading {
        if let Ok(seen) = self.seen.pop() {
            self.now = seen;
        }
        let r = &self.now.record;
        Reading {
            position_m: r.position_m,
            sequence: r.probe_sequence,
            age_ns: r.probe_age_ns,
            validity: r.validity,
        }
    }
}

struct RecordedClock(u64);

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

    fn restart(&mut self, _number: u64) {}
}

const _: () = assert!(
    SLOTS_PER_TICK <= 64,
    "the ring of a replay holds what a tick publishes"
);
