//! Replays the recorded probe readings through the same loop.
//!
//! Rig and clock are those of the recording (`recorded_rig`): they return every reading, every time and every request at its tick. The
//! decisions of the loop must then be equal, bit for bit. The behaviour of the amplifier follows from the recorded
//! trips.

mod recorded_rig;

use std::iter::Peekable;

use bench_hal::Tick;
use rtrb::Producer;
use serde::Serialize;

use crate::live::{OutsideEnds, connect, servo_run};
use crate::plan::{Plan, PlanError, RAMP_TICKS};
use bench_recording::{Recording, RecordingError};
use bench_rt::arming::{State, Trip};
use bench_rt::clock::TickTiming;
use bench_rt::program::Program;
use bench_rt::publisher::SLOTS_PER_TICK;
use bench_rt::record::{Event, EventKind, LoopMessage, Origin, RequestKind, TickRecord};
use bench_rt::servo::{Request, Servo};
use bench_rt::supervision::StopFlags;
use recorded_rig::{RecordedClock, RecordedRig, RecordedTick, RigFeed};

/// A recording that cannot be replayed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// The recording contains no plan.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The recording cannot be read.
    #[error(transparent)]
    Recording(#[from] RecordingError),
    /// The recording has gaps.
    #[error(
        "{lost} records are missing from the recording, the first after tick {after}: the input of the loop is not known there, so nothing after it can be replayed; choose a recording without lost records"
    )]
    Gap {
        /// Number of missing records.
        lost: u64,
        /// Last tick before the first gap.
        after: u64,
    },
}

/// A tick at which the replay differs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// Number of the tick.
    pub tick: u64,
    /// The recorded command in amperes.
    pub recorded_a: f64,
    /// The command of the replay in amperes.
    pub replayed_a: f64,
}

/// The result of a replay.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Replayed {
    /// Compared ticks.
    pub ticks: u64,
    /// Ticks that differ in command, request, reference, state or flags.
    pub different: u64,
    /// The first of them.
    pub first: Option<Difference>,
}

/// Replays a recording.
pub fn replay(recording: &Recording) -> Result<Replayed, ReplayError> {
    require_no_gap(recording)?;
    let mut events = recording.events().iter().peekable();
    let mut ticks = recording.ticks()?.peekable();
    let has_raw = matches!(ticks.peek(), Some(Ok(record)) if record.raw_position_m.is_some());
    let mut replay = Replay::new(&Plan::of(recording)?, has_raw, ramp_ticks(recording)?)?;
    for record in ticks {
        let record = record?;
        let amplifier_tripped = replay.feed_events(&mut events, record.tick);
        replay.tick(&RecordedTick {
            record,
            amplifier_tripped,
        });
    }
    Ok(replay.result)
}

/// The length of the ramps at the end of the run; 0 in recordings of older versions.
fn ramp_ticks(recording: &Recording) -> Result<u64, PlanError> {
    let Some(text) = recording.metadata().get(RAMP_TICKS) else {
        return Ok(0);
    };
    let ticks = text.parse();
    ticks.map_err(|_| PlanError::Missing("valid number of `ramp_ticks` in its metadata"))
}

/// Refuses a recording with lost records before its last tick: a gap between ticks, or lost requests.
fn require_no_gap(recording: &Recording) -> Result<(), ReplayError> {
    let gap = recording.gaps().iter().find(|gap| gap.lost > 0);
    let lost = recording.events().iter().find(|event| {
        matches!(event.kind, EventKind::Lost { .. }) && event.tick < recording.last_tick()
    });
    match gap
        .map(|gap| gap.after_tick)
        .or(lost.map(|event| event.tick))
    {
        None => Ok(()),
        Some(after) => Err(ReplayError::Gap {
            lost: recording.lost_records(),
            after,
        }),
    }
}

/// A loop around a recorded rig.
struct Replay {
    servo: Servo,
    outside: OutsideEnds,
    feed: RigFeed,
    stop_flags: StopFlags,
    program: Option<Box<dyn Program>>,
    result: Replayed,
}

impl Replay {
    /// `has_raw`: the recording contains the readings before the correction. Without a calibration, and in recordings of older
    /// versions, the recorded readings are those that the interlocks judged.
    fn new(plan: &Plan, has_raw: bool, ramp_ticks: u64) -> Result<Replay, PlanError> {
        let (connections, outside) = connect(SLOTS_PER_TICK);
        let correction = plan.correction().filter(|_| has_raw);
        let (rig, feed) = RecordedRig::new(correction);
        let stop_flags = StopFlags::default();
        let run = servo_run(plan, connections)?
            .with_correction(correction)
            .with_ramps(ramp_ticks)
            .with_stop_flags(stop_flags.clone());
        Ok(Replay {
            servo: Servo::new(Box::new(rig), Box::new(run), plan.config.servo.period_s()),
            stop_flags,
            outside,
            feed,
            program: Some(plan.program()?),
            result: Replayed::default(),
        })
    }

    /// Feeds the events up to a tick to loop and amplifier; returns whether the amplifier caused a trip.
    fn feed_events<'a>(
        &mut self,
        events: &mut Peekable<impl Iterator<Item = &'a Event>>,
        tick: u64,
    ) -> bool {
        let mut tripped = false;
        while let Some(event) = events.next_if(|event| event.tick <= tick) {
            match event.kind {
                EventKind::Request(request) if request.origin == Origin::Signal => {
                    self.stop_flags.raise();
                }
                EventKind::Request(request) => self.request(request.kind),
                // From `Enabling`; in recordings of older versions from `Disarmed`.
                EventKind::State {
                    to: State::Armed, ..
                } => {
                    let same_tick = |next: &&Event| next.tick == event.tick;
                    let refused = events.next_if(|next| same_tick(next) && is_amplifier_trip(next));
                    push(&mut self.feed.enables, refused.is_none());
                }
                CLEARING => push(&mut self.feed.clears, ()),
                _ => tripped |= is_amplifier_trip(event),
            }
        }
        tripped
    }

    fn request(&mut self, kind: RequestKind) {
        let request = match kind {
            RequestKind::Arm => Some(Request::Arm),
            RequestKind::Start => self.program.take().map(Request::Start),
            RequestKind::Finish => Some(Request::Finish),
            RequestKind::Stop => Some(Request::Stop),
            RequestKind::Clear => Some(Request::Clear),
            RequestKind::Tune(tune) => Some(Request::Tune(tune)),
        };
        if let Some(request) = request {
            // The loop empties the ring in every tick.
            let _ = self.outside.requests.send(request);
        }
    }

    fn tick(&mut self, tick: &RecordedTick) {
        let recorded = &tick.record;
        let timing = TickTiming {
            tick: Tick {
                number: recorded.tick,
                scheduled_ns: recorded.scheduled_ns,
            },
            woke_ns: recorded.woke_ns,
            missed: recorded.missed_ticks,
        };
        push(&mut self.feed.ticks, *tick);
        self.servo.tick(&timing, &RecordedClock(recorded.done_ns));
        while self.outside.retired.pop().is_ok() {}
        while let Ok(published) = self.outside.records.pop() {
            if let LoopMessage::Tick(replayed) = published {
                self.result.compare(recorded, &replayed);
            }
        }
    }
}

const CLEARING: EventKind = EventKind::State {
    from: State::Tripped,
    to: State::Disarmed,
};

/// Pushes to a ring that the loop or the rig empties within every tick, so that it is never full.
fn push<T>(ring: &mut Producer<T>, entry: T) {
    let _ = ring.push(entry);
}

fn is_amplifier_trip(event: &Event) -> bool {
    matches!(
        event.kind,
        EventKind::Trip(
            Trip::Amplifier { .. } | Trip::AmplifierDisabled | Trip::SetPointNotAccepted { .. }
        )
    )
}

/// The decisions of the loop in a tick, bit for bit.
fn decision(record: &TickRecord) -> ([u64; 3], State, u32) {
    let values = [record.command_a, record.requested_a, record.reference_m];
    (values.map(f64::to_bits), record.state, record.flags)
}

impl Replayed {
    fn compare(&mut self, recorded: &TickRecord, replayed: &TickRecord) {
        self.ticks += 1;
        if decision(recorded) == decision(replayed) {
            return;
        }
        self.different += 1;
        self.first.get_or_insert(Difference {
            tick: replayed.tick,
            recorded_a: recorded.command_a,
            replayed_a: replayed.command_a,
        });
    }
}
