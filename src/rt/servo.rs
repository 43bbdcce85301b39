//! The loop: read, check, decide, write, publish.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::Poll;

use bench_hal::{AmplifierStatus, DeviceError, Reading, Rig, Tick, Validity};
use rtrb::{Consumer, Producer};

use super::arming::{State, Transition, Trip};
use super::clock::{Clock, TickTiming};
use super::interlock::Interlocks;
use super::program::{Decision, Program, ProgramInput};
use super::publisher::Publisher;
use super::record::{
    EventKind, Origin, REQUESTS_PER_TICK, Refusal, RequestEvent, RequestKind, TickRecord, flag,
};
use super::request::NumberedRequest;
pub use super::request::Request;
use super::settling::{Settling, SettlingStep};
use super::supervision::{LeaseWatch, StopFlags, Supervision};
use crate::rig::calibration::Correction;

/// The current is unknown if the driver returns a value that is not finite.
const NOT_FINITE: DeviceError = DeviceError {
    what: "the driver returned a current that is not finite",
    remedy: "this is a fault of the driver; please report it",
    code: 0,
};

/// Period of the events with the clocks of the system.
const CLOCKS_PERIOD_NS: u64 = 1_000_000_000;

/// Progress of a running loop, for other threads.
#[derive(Debug, Default)]
pub struct Progress {
    /// Ticks of the program done so far.
    pub run_ticks: AtomicU64,
    /// Ticks without a record since the last recorded one.
    pub unrecorded_ticks: AtomicU64,
}

/// The loop and its state between ticks.
pub struct Servo {
    rig: Box<dyn Rig>,
    correction: Option<Correction>,
    interlocks: Interlocks,
    state: State,
    program: Option<Box<dyn Program>>,
    run_tick: u64,
    /// Length of each of the two ramps to zero current in ticks; without ramps if 0.
    ramp_ticks: u64,
    settling: Settling,
    supervision: Supervision,
    /// Who ended the run early without a request of the supervisor.
    stopped_by: Option<Origin>,
    /// Current in amperes that the program requested in the last tick.
    requested_a: f64,
    /// Current in amperes that the amplifier gives since the last tick.
    applied_a: f64,
    /// The same current as set-point of the amplifier, before the correction.
    raw_command_a: f64,
    connections: Connections,
    trip: Option<(Trip, u64)>,
    completed: bool,
    /// When the clocks are published next, in nanoseconds since the loop started.
    clocks_due_ns: u64,
    enabling: Enabling,
    /// Whether a reset of the amplifier has begun and not ended.
    is_clearing: bool,
}

/// Progress of [`State::Enabling`].
#[derive(Clone, Copy, Debug, Default)]
struct Enabling {
    /// Healthy ticks that are required before the amplifier is enabled.
    required_ticks: u64,
    /// Healthy ticks since the request to arm.
    healthy_ticks: u64,
    /// Whether the amplifier is being enabled.
    has_begun: bool,
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

impl Servo {
    /// A disarmed loop around a rig.
    pub fn new(rig: Box<dyn Rig>, interlocks: Interlocks, connections: Connections) -> Self {
        Servo {
            rig,
            correction: None,
            interlocks,
            state: State::Disarmed,
            program: None,
            run_tick: 0,
            ramp_ticks: 0,
            settling: Settling::new(0),
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
            is_clearing: false,
        }
    }

    /// The loop with the correction of a calibration. The interlocks judge readings and set-points before and after it.
    pub fn with_correction(mut self, correction: Option<Correction>) -> Self {
        self.correction = correction;
        self
    }

    /// The loop with ramps of `ramp_ticks` at the end of a run (see [`settling`](super::settling)). Without them the current
    /// goes to zero in one step.
    pub fn with_ramps(mut self, ramp_ticks: u64) -> Self {
        self.ramp_ticks = ramp_ticks;
        self
    }

    /// The loop with `ticks` healthy ticks between the request to arm and the enabling of the amplifier. A tick is healthy if no
    /// interlock would trip in it. The first tick is always judged before the amplifier is enabled.
    pub fn with_healthy_ticks(mut self, ticks: u64) -> Self {
        self.enabling.required_ticks = ticks;
        self
    }

    /// The loop with the flags that signals set.
    pub fn with_stop_flags(mut self, flags: StopFlags) -> Self {
        self.supervision.flags = flags;
        self
    }

    /// The loop with an arm lease, if there is one. When it expires, the loop ends the run along a ramp.
    pub fn with_lease(mut self, lease: Option<LeaseWatch>) -> Self {
        self.supervision.lease = lease;
        self
    }

    /// Executes one tick. It does not allocate, lock or print; its only system calls are those of the clock and of
    /// the devices.
    pub fn tick(&mut self, timing: &TickTiming, clock: &impl Clock) {
        let now = timing.tick;
        self.publish_clocks(now, clock);
        self.poll_clearing(now.number);
        self.take_requests(now.number);
        self.take_signals(now.number);
        self.check_lease(timing);
        let raw = self.rig.latest(now); // read
        let reading = self.corrected(raw);
        let checked = self.check(&raw, &reading, timing); // check
        self.advance_enabling(checked, now.number);
        let decision = self.decide(&reading, checked, now.number); // decide
        self.write(decision.requested_a, now.number); // write
        let done_ns = clock.now_ns(now);
        let record = self.record(timing, done_ns, &raw, &reading, &decision);
        self.publish(record); // publish
        self.finish_run(now.number);
    }

    fn publish(&mut self, record: TickRecord) {
        let Connections {
            publisher,
            progress,
            ..
        } = &mut self.connections;
        publisher.record(record);
        let unrecorded = publisher.lost_in_a_row();
        progress
            .unrecorded_ticks
            .store(unrecorded, Ordering::Relaxed);
    }

    /// Publishes the clocks of the system at the first tick and once per second.
    fn publish_clocks(&mut self, now: Tick, clock: &impl Clock) {
        if now.scheduled_ns < self.clocks_due_ns {
            return;
        }
        self.clocks_due_ns = now.scheduled_ns.saturating_add(CLOCKS_PERIOD_NS);
        if let Some(times) = clock.times() {
            self.event(now.number, EventKind::Clock(times));
        }
    }

    fn corrected(&self, raw: Reading) -> Reading {
        match self.correction {
            None => raw,
            Some(correction) => Reading {
                position_m: correction.position_m(raw.position_m),
                ..raw
            },
        }
    }

    /// Judges the reading of the probe as it is, and its corrected position: the stricter of both decides.
    fn check(&mut self, raw: &Reading, reading: &Reading, timing: &TickTiming) -> Result<(), Trip> {
        let missed = self.interlocks.check_timing(timing.missed, timing.tick);
        let raw = self.interlocks.check_reading(raw, timing.tick);
        let corrected = self.interlocks.check_travel(reading.position_m);
        let actual_a = self.rig.actual_current_a().filter(|_| !self.is_off());
        let current = self.interlocks.check_current(actual_a, timing.tick);
        match self.rig.status() {
            AmplifierStatus::Fault(code) => Err(Trip::Amplifier {
                code: i64::from(code),
                text: self.rig.explain(code),
            }),
            AmplifierStatus::Disabled if self.runs() => Err(Trip::AmplifierDisabled),
            AmplifierStatus::Disabled | AmplifierStatus::Enabled => {
                missed.and(raw).and(corrected).and(current)
            }
        }
    }

    fn decide(&mut self, reading: &Reading, checked: Result<(), Trip>, tick: u64) -> Decision {
        if let Err(trip) = checked {
            self.trip(trip, tick);
        }
        let input = ProgramInput {
            tick: self.run_tick,
            position_m: reading.position_m,
            applied_a: self.applied_a,
        };
        match (self.state, &mut self.program) {
            (State::Running, Some(program)) => program.decide(&input),
            (State::Settling, Some(program)) => {
                settle(&mut self.settling, program, &input, self.requested_a)
            }
            _ => Decision::default(),
        }
    }

    /// Commands the requested current if the interlocks allow it; otherwise switches everything off.
    fn write(&mut self, requested_a: f64, tick: u64) {
        self.requested_a = requested_a;
        (self.applied_a, self.raw_command_a) = (0.0, 0.0);
        if self.is_on()
            && let Err(trip) = self.command(requested_a)
        {
            self.trip(trip, tick);
        }
        self.interlocks
            .record_current(self.applied_a, self.raw_command_a);
    }

    /// Commands a current. The interlocks judge the current, the set-point that gives it, and what the amplifier accepts.
    fn command(&mut self, requested_a: f64) -> Result<(), Trip> {
        self.interlocks.check_command(requested_a)?;
        let set_point_a = match self.correction {
            None => requested_a,
            Some(correction) => {
                let set_point_a = correction.set_point_a(requested_a);
                self.interlocks.check_command(set_point_a)?;
                set_point_a
            }
        };
        let accepted_a = self.rig.command(set_point_a)?;
        if !accepted_a.is_finite() {
            return Err(NOT_FINITE.into());
        }
        self.interlocks.check_accepted(set_point_a, accepted_a)?;
        self.raw_command_a = accepted_a;
        self.applied_a = match self.correction {
            None => accepted_a,
            Some(correction) => correction.current_a(accepted_a),
        };
        Ok(())
    }

    fn record(
        &self,
        timing: &TickTiming,
        done_ns: u64,
        raw: &Reading,
        reading: &Reading,
        decision: &Decision,
    ) -> TickRecord {
        TickRecord {
            tick: timing.tick.number,
            scheduled_ns: timing.tick.scheduled_ns,
            woke_ns: timing.woke_ns,
            done_ns,
            reference_m: decision.reference_m,
            position_m: reading.position_m,
            requested_a: decision.requested_a,
            command_a: self.applied_a,
            raw_position_m: self.correction.map(|_| raw.position_m),
            raw_command_a: self.correction.map(|_| self.raw_command_a),
            actual_a: self.rig.actual_current_a(),
            probe_sequence: reading.sequence,
            probe_age_ns: reading.age_ns,
            validity: reading.validity,
            state: self.state,
            flags: self.flags(timing, reading, decision),
            missed_ticks: timing.missed,
        }
    }

    fn flags(&self, timing: &TickTiming, reading: &Reading, decision: &Decision) -> u32 {
        let limited = self.applied_a.to_bits() != decision.requested_a.to_bits();
        let tripped = self
            .trip
            .is_some_and(|(_, tick)| tick == timing.tick.number);
        (flag::ACTIVE * u32::from(decision.active))
            | (flag::LIMITED * u32::from(limited))
            | (flag::OVERRUN * u32::from(timing.missed > 0))
            | (flag::INVALID * u32::from(reading.validity != Validity::Valid))
            | (flag::TRIPPED * u32::from(tripped))
    }

    fn finish_run(&mut self, tick: u64) {
        let ticks = self.program.as_ref().map_or(0, |program| program.ticks());
        match self.state {
            State::Running => self.count_tick(tick, ticks),
            State::Settling if self.settling.is_done() => self.switch_off(Transition::Stop, tick),
            State::Settling => self.run_tick = (self.run_tick + 1).min(ticks.saturating_sub(1)),
            State::Disarmed | State::Enabling | State::Armed | State::Tripped => {}
        }
    }

    /// Counts a tick of the program; after the last one the run ends.
    fn count_tick(&mut self, tick: u64, ticks: u64) {
        self.run_tick += 1;
        let progress = &self.connections.progress.run_ticks;
        progress.store(self.run_tick, Ordering::Relaxed);
        if self.run_tick >= ticks {
            self.completed = true;
            self.event(tick, EventKind::Completed);
            self.run_tick = ticks.saturating_sub(1);
            self.finish(tick);
        }
    }

    /// Ends the run: the current goes to zero along a ramp. Without a run, or without current, the amplifier is disabled at
    /// once.
    fn finish(&mut self, tick: u64) {
        match self.state {
            State::Running if self.ramp_ticks > 0 && self.requested_a != 0.0 => {
                self.settling = Settling::new(self.ramp_ticks);
                self.change(Transition::Finish, tick);
            }
            State::Running | State::Armed | State::Enabling => {
                self.switch_off(Transition::Stop, tick);
            }
            State::Settling | State::Disarmed | State::Tripped => {}
        }
    }

    fn take_requests(&mut self, tick: u64) {
        for _ in 0..REQUESTS_PER_TICK {
            let Ok(NumberedRequest { id, request }) = self.connections.requests.pop() else {
                return;
            };
            self.answer(id, Origin::Supervisor, request.kind(), tick);
            self.take(request, tick);
        }
    }

    /// Why a request is refused; `None` if it is accepted.
    fn refusal(&self, kind: RequestKind) -> Option<Refusal> {
        let waits = self.state == State::Enabling && self.program.is_some();
        match kind {
            RequestKind::Start if waits => Some(Refusal::NotArmed),
            _ => kind.refusal(self.state),
        }
    }

    /// Publishes a request and whether this state allows it.
    fn answer(&mut self, id: u64, origin: Origin, kind: RequestKind, tick: u64) {
        let request = RequestEvent {
            id,
            origin,
            kind,
            refusal: self.refusal(kind),
        };
        self.event(tick, EventKind::Request(request));
    }

    fn take_signals(&mut self, tick: u64) {
        for request in self.supervision.signalled() {
            self.end(request, Origin::Signal, tick);
        }
    }

    /// An expired arm lease ends a run, and disarms an armed loop.
    fn check_lease(&mut self, timing: &TickTiming) {
        let expired = self.supervision.lease_expired(timing.missed);
        if expired && RequestKind::Finish.refusal(self.state).is_none() {
            self.end(Request::Finish, Origin::Lease, timing.tick.number);
        }
    }

    /// Ends the run without a request of the supervisor.
    fn end(&mut self, request: Request, origin: Origin, tick: u64) {
        self.answer(0, origin, request.kind(), tick);
        self.stopped_by.get_or_insert(origin);
        self.take(request, tick);
    }

    fn take(&mut self, request: Request, tick: u64) {
        match request {
            Request::Arm => self.arm(tick),
            Request::Start(program) => self.start(program, tick),
            Request::Finish => self.finish(tick),
            Request::Stop => self.switch_off(Transition::Stop, tick),
            Request::Clear => self.clear(tick),
        }
    }

    /// Begins to enable: [`Servo::advance_enabling`] continues in this tick and in the next ones.
    fn arm(&mut self, tick: u64) {
        if self.state.after(Transition::Arm).is_some() {
            self.enabling = Enabling {
                required_ticks: self.enabling.required_ticks,
                ..Enabling::default()
            };
            self.change(Transition::Arm, tick);
        }
    }

    /// Counts a healthy tick in [`State::Enabling`]. When the amplifier is enabled, a program that waits is started.
    fn advance_enabling(&mut self, checked: Result<(), Trip>, tick: u64) {
        if self.state != State::Enabling || checked.is_err() {
            return;
        }
        self.enabling.healthy_ticks += 1;
        match self.enable_amplifier() {
            Poll::Pending => {}
            Poll::Ready(Err(error)) => self.trip(Trip::from(error), tick),
            Poll::Ready(Ok(())) => {
                self.change(Transition::Enabled, tick);
                if self.program.is_some() {
                    self.begin_run(tick);
                }
            }
        }
    }

    fn enable_amplifier(&mut self) -> Poll<Result<(), DeviceError>> {
        if self.enabling.healthy_ticks < self.enabling.required_ticks {
            return Poll::Pending;
        }
        if !self.enabling.has_begun {
            self.enabling.has_begun = true;
            self.rig.begin_enable()?;
        }
        self.rig.poll_enable()
    }

    /// Begins to reset the fault of the amplifier. If the amplifier keeps its fault, the trip remains.
    fn clear(&mut self, tick: u64) {
        if self.state.after(Transition::Clear).is_some() && !self.is_clearing {
            self.is_clearing = self.rig.begin_reset().is_ok();
            self.poll_clearing(tick);
        }
    }

    /// Clears the trip when the amplifier has reset its fault.
    fn poll_clearing(&mut self, tick: u64) {
        if !self.is_clearing {
            return;
        }
        if let Poll::Ready(result) = self.rig.poll_reset() {
            self.is_clearing = false;
            if result.is_ok() {
                self.change(Transition::Clear, tick);
            }
        }
    }

    /// Starts a program, or keeps it until the amplifier is enabled. In other states, and if another program waits already, it is
    /// returned.
    fn start(&mut self, program: Box<dyn Program>, tick: u64) {
        match self.state {
            State::Enabling if self.program.is_none() => self.program = Some(program),
            State::Armed => {
                let old = self.program.replace(program);
                self.retire(old);
                self.begin_run(tick);
            }
            State::Enabling
            | State::Disarmed
            | State::Running
            | State::Settling
            | State::Tripped => {
                self.retire(Some(program));
            }
        }
    }

    fn begin_run(&mut self, tick: u64) {
        self.change(Transition::Start, tick);
        (self.run_tick, self.completed, self.trip) = (0, false, None);
    }

    /// Zero current in this tick, amplifier disabled, the reason published.
    fn trip(&mut self, trip: Trip, tick: u64) {
        if self.state.after(Transition::Trip).is_some() {
            self.trip = Some((trip, tick));
            self.event(tick, EventKind::Trip(trip));
            self.switch_off(Transition::Trip, tick);
        }
    }

    fn switch_off(&mut self, transition: Transition, tick: u64) {
        self.rig.disable();
        self.change(transition, tick);
        let program = self.program.take();
        self.retire(program);
    }

    fn change(&mut self, transition: Transition, tick: u64) {
        if let Some(to) = self.state.after(transition) {
            let from = self.state;
            self.event(tick, EventKind::State { from, to });
            self.state = to;
        }
    }

    fn event(&mut self, tick: u64, kind: EventKind) {
        self.connections.publisher.event(tick, kind);
    }

    /// Passes a program on to be freed outside the loop. Without room in the ring its memory is leaked, not freed here.
    fn retire(&mut self, program: Option<Box<dyn Program>>) {
        let Some(program) = program else { return };
        if let Err(rtrb::PushError::Full(program)) = self.connections.retired.push(program) {
            std::mem::forget(program);
        }
    }

    /// Whether the amplifier is enabled.
    fn is_on(&self) -> bool {
        self.state == State::Armed || self.runs()
    }

    /// Whether a run goes on or settles: current may flow.
    fn runs(&self) -> bool {
        matches!(self.state, State::Running | State::Settling)
    }

    /// Whether the amplifier is disabled and is not being enabled.
    pub fn is_off(&self) -> bool {
        matches!(self.state, State::Disarmed | State::Tripped)
    }

    /// The trip since the last start, if there was one, and its tick.
    pub fn last_trip(&self) -> Option<(Trip, u64)> {
        self.trip
    }

    /// Whether the program ran to its end.
    pub fn completed(&self) -> bool {
        self.completed
    }

    /// Who ended the run early without a request of the supervisor: a signal or the arm lease.
    pub fn stopped_by(&self) -> Option<Origin> {
        self.stopped_by
    }

    /// The thermal state of the motor in A^2.
    pub fn thermal_a2(&self) -> f64 {
        self.interlocks.thermal_a2()
    }

    /// The connection to the recorder.
    pub fn publisher(&self) -> &Publisher {
        &self.connections.publisher
    }
}

/// The decision in a tick of [`State::Settling`], which does not belong to the experiment any more.
fn settle(
    settling: &mut Settling,
    program: &mut Box<dyn Program>,
    input: &ProgramInput,
    requested_a: f64,
) -> Decision {
    let decision = match settling.next(requested_a) {
        SettlingStep::Program { scale } => program.settle(input, scale),
        SettlingStep::Current(requested_a) => Decision {
            requested_a,
            ..Decision::default()
        },
        SettlingStep::Done => Decision::default(),
    };
    Decision {
        active: false,
        ..decision
    }
}

impl Drop for Servo {
    /// However the loop ends, the amplifier is disabled.
    fn drop(&mut self) {
        self.rig.disable();
    }
}
