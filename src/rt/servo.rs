//! The loop: read, check, decide, write, publish.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use bench_hal::{AmplifierStatus, DeviceError, Reading, Rig, Validity};
use rtrb::{Consumer, Producer};

use super::arming::{State, Transition, Trip};
use super::clock::{Clock, TickTiming};
use super::interlock::Interlocks;
use super::program::{Decision, Program};
use super::publisher::Publisher;
use super::record::{EventKind, RequestKind, TickRecord, flag};

/// The answer of a driver to a command was not a number.
const NONSENSE: DeviceError = DeviceError {
    what: "the driver does not say which current it gives",
    remedy: "this is a fault of the driver; please report it",
    code: 0,
};

/// Orders that one tick takes; more wait for the next.
pub const REQUESTS_PER_TICK: usize = 16;

/// An order to the loop, taken at a tick boundary. What it carries is whole and immutable.
pub enum Request {
    /// Enable the amplifier.
    Arm,
    /// Run a program from the next tick on.
    Start(Box<dyn Program>),
    /// Zero current, disarm.
    Stop,
    /// A person clears a trip.
    Clear,
}

impl Request {
    fn kind(&self) -> RequestKind {
        match self {
            Request::Arm => RequestKind::Arm,
            Request::Start(_) => RequestKind::Start,
            Request::Stop => RequestKind::Stop,
            Request::Clear => RequestKind::Clear,
        }
    }
}

/// What others see of a running loop.
#[derive(Debug, Default)]
pub struct Progress {
    /// Ticks of the program done so far.
    pub run_ticks: AtomicU64,
}

/// The loop's memory between ticks.
pub struct Servo {
    rig: Box<dyn Rig>,
    interlocks: Interlocks,
    state: State,
    program: Option<Box<dyn Program>>,
    run_tick: u64,
    requests: Consumer<Request>,
    retired: Producer<Box<dyn Program>>,
    publisher: Publisher,
    progress: Arc<Progress>,
    trip: Option<(Trip, u64)>,
    completed: bool,
    slow_order: bool,
}

/// The ends of the rings that the loop holds.
pub struct Connections {
    /// Orders of the supervisor.
    pub requests: Consumer<Request>,
    /// Programs that are done with: freed outside.
    pub retired: Producer<Box<dyn Program>>,
    /// To the recorder.
    pub publisher: Publisher,
    /// For whoever watches.
    pub progress: Arc<Progress>,
}

impl Servo {
    /// A disarmed loop around a rig.
    pub fn new(rig: Box<dyn Rig>, interlocks: Interlocks, connections: Connections) -> Self {
        let Connections {
            requests,
            retired,
            publisher,
            progress,
        } = connections;
        Servo {
            rig,
            interlocks,
            state: State::Disarmed,
            program: None,
            run_tick: 0,
            requests,
            retired,
            publisher,
            progress,
            trip: None,
            completed: false,
            slow_order: false,
        }
    }

    /// One tick. Allocates nothing, takes no lock, prints nothing, calls no system function but clock and devices.
    pub fn tick(&mut self, moment: &TickTiming, clock: &impl Clock) {
        let now = moment.tick;
        self.take_orders(now.number);
        let reading = self.rig.latest(now); // read
        let checked = self.check(&reading, moment); // check
        let decision = self.decide(&reading, checked, now.number); // decide
        let command_a = self.write(decision.requested_a, now.number); // write
        let done_ns = clock.now_ns(now);
        self.publish(moment, done_ns, &reading, &decision, command_a); // publish
        self.finish_run(now.number);
    }

    fn check(&mut self, reading: &Reading, moment: &TickTiming) -> Result<(), Trip> {
        let timing = self.interlocks.check_timing(moment.missed, moment.tick);
        let reading = self.interlocks.check_reading(reading, moment.tick);
        let is_on = matches!(self.state, State::Armed | State::Running);
        let current =
            self.interlocks
                .check_current(is_on, self.rig.actual_current_a(), moment.tick);
        match self.rig.status() {
            AmplifierStatus::Fault(code) => Err(Trip::Amplifier {
                code: i64::from(code),
                words: self.rig.explain(code),
            }),
            _ => timing.and(reading).and(current),
        }
    }

    fn decide(&mut self, reading: &Reading, checked: Result<(), Trip>, tick: u64) -> Decision {
        if let Err(trip) = checked {
            self.trip(trip, tick);
        }
        match (self.state, &mut self.program) {
            (State::Running, Some(program)) => program.decide(self.run_tick, reading.position_m),
            _ => Decision::default(),
        }
    }

    /// The last gate: the command passes the interlocks and goes out, or everything goes off.
    fn write(&mut self, requested_a: f64, tick: u64) -> f64 {
        let mut command_a = 0.0;
        if matches!(self.state, State::Armed | State::Running) {
            let passed = self.interlocks.check_command(requested_a);
            match passed.and_then(|()| self.rig.command(requested_a).map_err(Trip::from)) {
                Ok(given_a) if given_a.is_finite() => command_a = given_a,
                // No driver may say so; what really flows is then unknown.
                Ok(_) => self.trip(Trip::from(NONSENSE), tick),
                Err(trip) => self.trip(trip, tick),
            }
        }
        self.interlocks.note(command_a);
        command_a
    }

    fn publish(
        &mut self,
        moment: &TickTiming,
        done_ns: u64,
        reading: &Reading,
        decision: &Decision,
        command_a: f64,
    ) {
        let bit = |set: bool, bit: u32| if set { bit } else { 0 };
        let tripped_now = self
            .trip
            .is_some_and(|(_, tick)| tick == moment.tick.number);
        self.publisher.record(TickRecord {
            tick: moment.tick.number,
            scheduled_ns: moment.tick.scheduled_ns,
            woke_ns: moment.woke_ns,
            done_ns,
            reference_m: decision.reference_m,
            position_m: reading.position_m,
            requested_a: decision.requested_a,
            command_a,
            actual_a: self.rig.actual_current_a(),
            probe_sequence: reading.sequence,
            probe_age_ns: reading.age_ns,
            validity: reading.validity,
            state: self.state,
            flags: bit(decision.active, flag::ACTIVE)
                | bit(
                    command_a.to_bits() != decision.requested_a.to_bits(),
                    flag::LIMITED,
                )
                | bit(moment.missed > 0, flag::OVERRUN)
                | bit(reading.validity != Validity::Valid, flag::INVALID)
                | bit(tripped_now, flag::TRIPPED),
            missed_ticks: moment.missed,
        });
    }

    fn finish_run(&mut self, tick: u64) {
        if self.state != State::Running {
            return;
        }
        self.run_tick += 1;
        self.progress
            .run_ticks
            .store(self.run_tick, Ordering::Relaxed);
        if self
            .program
            .as_ref()
            .is_some_and(|program| self.run_tick >= program.ticks())
        {
            self.completed = true;
            self.publisher.event(tick, EventKind::Completed);
            self.switch_off(Transition::Stop, tick);
        }
    }

    fn take_orders(&mut self, tick: u64) {
        for _ in 0..REQUESTS_PER_TICK {
            let Ok(order) = self.requests.pop() else {
                return;
            };
            self.publisher.event(tick, EventKind::Request(order.kind()));
            match order {
                Request::Arm => self.arm(tick),
                Request::Start(program) => self.start(program, tick),
                Request::Stop => self.switch_off(Transition::Stop, tick),
                Request::Clear => self.clear(tick),
            }
        }
    }

    /// Enabling may take its time; nothing moves yet, and the schedule begins anew after it. Where the order changes
    /// nothing, neither does it: a schedule that begins anew in the middle of a run would hide a late tick.
    fn arm(&mut self, tick: u64) {
        if self.state.after(Transition::Arm).is_none() {
            return;
        }
        self.slow_order = true;
        self.change(Transition::Arm, tick);
        if let Err(error) = self.rig.enable() {
            self.trip(Trip::from(error), tick);
        }
    }

    /// A person's acknowledgement reaches the amplifier too; as long as that keeps its fault, the trip stays.
    fn clear(&mut self, tick: u64) {
        if self.state.after(Transition::Clear).is_none() {
            return;
        }
        self.slow_order = true;
        if self.rig.reset_fault().is_ok() {
            self.change(Transition::Clear, tick);
        }
    }

    fn start(&mut self, program: Box<dyn Program>, tick: u64) {
        let before = self.state;
        self.change(Transition::Start, tick);
        let old = if self.state == State::Running && before != State::Running {
            (self.run_tick, self.completed, self.trip) = (0, false, None);
            self.program.replace(program)
        } else {
            Some(program)
        };
        self.hand_back(old);
    }

    /// Zero current now, amplifier disabled, the reason published.
    fn trip(&mut self, trip: Trip, tick: u64) {
        if self.state.after(Transition::Trip).is_some() {
            self.trip = Some((trip, tick));
            self.publisher.event(tick, EventKind::Trip(trip));
            self.switch_off(Transition::Trip, tick);
        }
    }

    fn switch_off(&mut self, change: Transition, tick: u64) {
        self.rig.disable();
        self.change(change, tick);
        let program = self.program.take();
        self.hand_back(program);
    }

    fn change(&mut self, change: Transition, tick: u64) {
        if let Some(to) = self.state.after(change) {
            self.publisher.event(
                tick,
                EventKind::State {
                    from: self.state,
                    to,
                },
            );
            self.state = to;
        }
    }

    /// Memory is freed outside the loop; if nobody collects it, it is kept rather than freed here.
    fn hand_back(&mut self, program: Option<Box<dyn Program>>) {
        if let Some(rtrb::PushError::Full(program)) =
            program.and_then(|program| self.retired.push(program).err())
        {
            std::mem::forget(program);
        }
    }

    /// Whether an order since the last call took its time, so that the schedule must begin anew.
    pub fn took_slow_request(&mut self) -> bool {
        std::mem::take(&mut self.slow_order)
    }

    /// Neither armed nor running.
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

    /// The way to the recorder.
    pub fn publisher(&self) -> &Publisher {
        &self.publisher
    }
}

impl Drop for Servo {
    /// Whatever ends the loop, the motor is off.
    fn drop(&mut self) {
        self.rig.disable();
    }
}
