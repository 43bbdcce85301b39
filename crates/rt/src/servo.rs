//! The loop: read, check, decide, write, publish.

mod requests;

use std::sync::atomic::Ordering;
use std::task::Poll;

use bench_hal::{AmplifierStatus, DeviceError, Reading, Rig, Tick, Validity};

use super::arming::{State, Transition, Trip};
use super::clock::{Clock, TickTiming, scheduled_ns};
use super::device_defect::DeviceDefect;
use super::program::{Decision, Program, ProgramInput};
use super::record::{EventKind, TickRecord, flag};
pub use super::request::Request;
use super::servo_run::{Connections, Enabling, ServoRun};
use super::settling::{Settling, SettlingStep};
use super::tuning::{Factors, Tuning};

/// The current is unknown if the driver returns a value that is not finite.
const NOT_FINITE: DeviceError = DeviceError {
    what: "the driver returned a current that is not finite",
    remedy: "this is a fault of the driver; please report it",
    code: 0,
};

/// Period of the events with the clocks of the system.
const CLOCKS_PERIOD_NS: u64 = 1_000_000_000;

/// The loop and its state between ticks. It lives as long as the rig; what belongs to one run is in [`ServoRun`].
pub struct Servo {
    rig: Box<dyn Rig>,
    run: Box<ServoRun>,
    state: State,
    /// Whether a reset of the amplifier has begun and not ended.
    is_clearing: bool,
    /// Ticks of the rig so far. Each run counts its own ticks from 0.
    rig_ticks: u64,
    /// Ticks of the rig before this run.
    rig_ticks_before: u64,
    period_s: f64,
}

impl Servo {
    /// A disarmed loop around a rig, with ticks of `period_s`.
    pub fn new(rig: Box<dyn Rig>, run: Box<ServoRun>, period_s: f64) -> Self {
        Servo {
            rig,
            run,
            state: State::Disarmed,
            is_clearing: false,
            rig_ticks: 0,
            rig_ticks_before: 0,
            period_s,
        }
    }

    /// Begins another run, and returns the one before. An amplifier that is not off is disabled first. A trip remains until it is
    /// cleared. Must not allocate or block.
    pub fn exchange(&mut self, run: Box<ServoRun>) -> Box<ServoRun> {
        if !self.is_off() {
            self.rig.disable();
            self.state = State::Disarmed;
        }
        self.rig_ticks_before = self.rig_ticks;
        std::mem::replace(&mut self.run, run)
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
        let rig_tick = self.rig_tick(now);
        let raw = self.rig.latest(rig_tick); // read
        let reading = self.corrected(raw);
        let checked = self.check(&raw, &reading, timing); // check
        self.advance_enabling(checked, now.number);
        let decision = self.decide(&reading, checked, now.number); // decide
        self.write(decision.requested_a, now.number); // write
        self.record_motion(&decision);
        let done_ns = clock.now_ns(now);
        let record = self.record(timing, done_ns, &raw, &reading, &decision);
        self.publish(record); // publish
        self.finish_run(now.number);
    }

    /// A tick of the run as tick of the rig.
    fn rig_tick(&mut self, now: Tick) -> Tick {
        let number = self.rig_ticks_before + now.number;
        self.rig_ticks = number + 1;
        Tick {
            number,
            scheduled_ns: scheduled_ns(number, self.period_s),
        }
    }

    fn publish(&mut self, record: TickRecord) {
        let Connections {
            publisher,
            progress,
            ..
        } = &mut self.run.connections;
        publisher.record(record);
        let unrecorded = publisher.lost_in_a_row();
        progress
            .unrecorded_ticks
            .store(unrecorded, Ordering::Relaxed);
    }

    /// Publishes the clocks of the system at the first tick and once per second.
    fn publish_clocks(&mut self, now: Tick, clock: &impl Clock) {
        if now.scheduled_ns < self.run.clocks_due_ns {
            return;
        }
        self.run.clocks_due_ns = now.scheduled_ns.saturating_add(CLOCKS_PERIOD_NS);
        if let Some(times) = clock.times() {
            self.event(now.number, EventKind::Clock(times));
        }
    }

    fn corrected(&self, raw: Reading) -> Reading {
        match self.run.correction {
            None => raw,
            Some(correction) => Reading {
                position_m: correction.position_m(raw.position_m),
                ..raw
            },
        }
    }

    /// Judges the reading of the probe as it is, and its corrected position: the stricter of both decides.
    fn check(&mut self, raw: &Reading, reading: &Reading, timing: &TickTiming) -> Result<(), Trip> {
        let missed = self.run.interlocks.check_timing(timing.missed, timing.tick);
        let raw = self.run.interlocks.check_reading(raw, timing.tick);
        let corrected = self.run.interlocks.check_travel(reading.position_m);
        let motion = self.check_motion(reading.position_m, timing.missed);
        let actual_a = self.rig.actual_current_a().filter(|_| !self.is_off());
        let current = self.run.interlocks.check_current(actual_a, timing.tick);
        let status = self.rig.status();
        let defect = &self.run.connections.progress.defect;
        defect.set(DeviceDefect::of(status, raw));
        match status {
            AmplifierStatus::Fault(code) => Err(Trip::Amplifier {
                code: i64::from(code),
                text: self.rig.explain(code),
            }),
            AmplifierStatus::Disabled if self.runs() => Err(Trip::AmplifierDisabled),
            AmplifierStatus::Disabled | AmplifierStatus::Enabled => {
                missed.and(raw).and(corrected).and(current).and(motion)
            }
        }
    }

    fn check_motion(&mut self, position_m: f64, missed: u32) -> Result<(), Trip> {
        if self.runs() {
            self.run.interlocks.check_motion(position_m, missed)
        } else {
            Ok(())
        }
    }

    fn record_motion(&mut self, decision: &Decision) {
        let gain = self.run.tuning.now().gain;
        (self.run.interlocks).record_motion(decision, gain, self.run.applied_a);
    }

    fn decide(&mut self, reading: &Reading, checked: Result<(), Trip>, tick: u64) -> Decision {
        if let Err(trip) = checked {
            self.trip(trip, tick);
        }
        let input = ProgramInput {
            tick: self.run.program_tick,
            position_m: reading.position_m,
            applied_a: self.run.applied_a,
            factors: self.factors(),
        };
        match (self.state, &mut self.run.program) {
            (State::Running, Some(program)) => program.decide(&input),
            (State::Settling, Some(program)) => settle(
                &mut self.run.settling,
                program,
                &input,
                self.run.requested_a,
            ),
            _ => Decision::default(),
        }
    }

    /// The factors of reference and loop gain in this tick.
    fn factors(&mut self) -> Factors {
        if self.runs() {
            self.run.tuning.next()
        } else {
            Factors::default()
        }
    }

    /// Commands the requested current if the interlocks allow it; otherwise switches everything off.
    fn write(&mut self, requested_a: f64, tick: u64) {
        self.run.requested_a = requested_a;
        (self.run.applied_a, self.run.raw_command_a) = (0.0, 0.0);
        if self.is_on()
            && let Err(trip) = self.command(requested_a)
        {
            self.trip(trip, tick);
        }
        self.run
            .interlocks
            .record_current(self.run.applied_a, self.run.raw_command_a);
    }

    /// Commands a current. The interlocks judge the current, the set-point that gives it, and what the amplifier accepts.
    fn command(&mut self, requested_a: f64) -> Result<(), Trip> {
        self.run.interlocks.check_command(requested_a)?;
        let set_point_a = match self.run.correction {
            None => requested_a,
            Some(correction) => {
                let set_point_a = correction.set_point_a(requested_a);
                self.run.interlocks.check_command(set_point_a)?;
                set_point_a
            }
        };
        let accepted_a = self.rig.command(set_point_a)?;
        if !accepted_a.is_finite() {
            return Err(NOT_FINITE.into());
        }
        self.run
            .interlocks
            .check_accepted(set_point_a, accepted_a)?;
        self.run.raw_command_a = accepted_a;
        self.run.applied_a = match self.run.correction {
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
            command_a: self.run.applied_a,
            raw_position_m: self.run.correction.map(|_| raw.position_m),
            raw_command_a: self.run.correction.map(|_| self.run.raw_command_a),
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
        let limited = self.run.applied_a.to_bits() != decision.requested_a.to_bits();
        let tripped = self
            .run
            .trip
            .is_some_and(|(_, tick)| tick == timing.tick.number);
        (flag::ACTIVE * u32::from(decision.active))
            | (flag::LIMITED * u32::from(limited))
            | (flag::OVERRUN * u32::from(timing.missed > 0))
            | (flag::INVALID * u32::from(reading.validity != Validity::Valid))
            | (flag::TRIPPED * u32::from(tripped))
    }

    fn finish_run(&mut self, tick: u64) {
        let ticks = self
            .run
            .program
            .as_ref()
            .map_or(0, |program| program.ticks());
        match self.state {
            State::Running => self.count_tick(tick, ticks),
            State::Settling if self.run.settling.is_done() => {
                self.switch_off(Transition::Stop, tick)
            }
            State::Settling => {
                self.run.program_tick = (self.run.program_tick + 1).min(ticks.saturating_sub(1))
            }
            State::Disarmed | State::Enabling | State::Armed | State::Tripped => {}
        }
    }

    /// Counts a tick of the program; after the last one the run ends.
    fn count_tick(&mut self, tick: u64, ticks: u64) {
        self.run.program_tick += 1;
        let progress = &self.run.connections.progress.run_ticks;
        progress.store(self.run.program_tick, Ordering::Relaxed);
        if self.run.program_tick >= ticks {
            self.run.completed = true;
            self.event(tick, EventKind::Completed);
            self.run.program_tick = ticks.saturating_sub(1);
            self.finish(tick);
        }
    }

    /// Ends the run: the current goes to zero along a ramp. Without a run, or without current, the amplifier is disabled at
    /// once.
    fn finish(&mut self, tick: u64) {
        match self.state {
            State::Running if self.run.ramp_ticks > 0 && self.run.requested_a != 0.0 => {
                self.run.settling = Settling::new(self.run.ramp_ticks);
                self.change(Transition::Finish, tick);
            }
            State::Running | State::Armed | State::Enabling => {
                self.switch_off(Transition::Stop, tick);
            }
            State::Settling | State::Disarmed | State::Tripped => {}
        }
    }

    /// Begins to enable: [`Servo::advance_enabling`] continues in this tick and in the next ones.
    fn arm(&mut self, tick: u64) {
        if self.state.after(Transition::Arm).is_some() {
            self.run.enabling = Enabling {
                required_ticks: self.run.enabling.required_ticks,
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
        self.run.enabling.healthy_ticks += 1;
        match self.enable_amplifier() {
            Poll::Pending => {}
            Poll::Ready(Err(error)) => self.trip(Trip::from(error), tick),
            Poll::Ready(Ok(())) => {
                self.change(Transition::Enabled, tick);
                if self.run.program.is_some() {
                    self.begin_run(tick);
                }
            }
        }
    }

    fn enable_amplifier(&mut self) -> Poll<Result<(), DeviceError>> {
        if self.run.enabling.healthy_ticks < self.run.enabling.required_ticks {
            return Poll::Pending;
        }
        if !self.run.enabling.has_begun {
            self.run.enabling.has_begun = true;
            self.rig.begin_enable()?;
        }
        self.rig.poll_enable()
    }

    /// Begins to reset the fault of the amplifier. If the amplifier keeps its fault, the trip remains and an event says so. An Arm
    /// before the end of the reset is refused, because the state is still Tripped.
    fn clear(&mut self, tick: u64) {
        if self.state.after(Transition::Clear).is_none() || self.is_clearing {
            return;
        }
        match self.rig.begin_reset() {
            Ok(()) => {
                self.is_clearing = true;
                self.poll_clearing(tick);
            }
            Err(error) => self.event(tick, EventKind::reset_failed(error)),
        }
    }

    /// Clears the trip when the amplifier has reset its fault.
    fn poll_clearing(&mut self, tick: u64) {
        if !self.is_clearing {
            return;
        }
        let Poll::Ready(result) = self.rig.poll_reset() else {
            return;
        };
        self.is_clearing = false;
        match result {
            Ok(()) => self.change(Transition::Clear, tick),
            Err(error) => self.event(tick, EventKind::reset_failed(error)),
        }
    }

    /// Starts a program, or keeps it until the amplifier is enabled. In other states, and if another program waits already, it is
    /// returned.
    fn start(&mut self, program: Box<dyn Program>, tick: u64) {
        match self.state {
            State::Enabling if self.run.program.is_none() => self.run.program = Some(program),
            State::Armed => {
                let old = self.run.program.replace(program);
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
        (self.run.program_tick, self.run.completed, self.run.trip) = (0, false, None);
        self.run.tuning = Tuning::default();
        self.run.interlocks.begin_run();
    }

    /// Zero current in this tick, amplifier disabled, the reason published.
    fn trip(&mut self, trip: Trip, tick: u64) {
        if self.state.after(Transition::Trip).is_some() {
            self.run.trip = Some((trip, tick));
            self.event(tick, EventKind::Trip(trip));
            self.switch_off(Transition::Trip, tick);
        }
    }

    fn switch_off(&mut self, transition: Transition, tick: u64) {
        self.rig.disable();
        self.change(transition, tick);
        let program = self.run.program.take();
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
        self.run.connections.publisher.event(tick, kind);
    }

    /// Passes a program on to be freed outside the loop. Without room in the ring its memory is leaked, not freed here.
    fn retire(&mut self, program: Option<Box<dyn Program>>) {
        let Some(program) = program else { return };
        if let Err(rtrb::PushError::Full(program)) = self.run.connections.retired.push(program) {
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

    /// The run.
    pub fn run(&self) -> &ServoRun {
        &self.run
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
