//! The state machine of the loop, written from its documentation: the diagram of `rt::arming`, and the rules for requests, signals,
//! the arm lease, the ramps and the heat of the motor. It knows what happens in a tick, and predicts the state and the current.
use std::collections::VecDeque;
use std::f64::consts::TAU;

use bench_config::Config;
use bench_rt::arming::State;

use crate::state_machine::sequence::{Fault, Faults, Load, Order, TickInputs};

/// Settings of a run.
#[derive(Clone, Copy, Debug)]
pub struct RunSettings {
    pub ramp_ticks: u64,
    pub healthy_ticks: u64,
    pub lease_ticks: u64,
}

/// What the loop must do in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expected {
    /// State in which the command is sent, or to which the tick trips.
    pub state: State,
    /// Command in amperes; `None` if the amplifier must be off.
    pub command_a: Option<f64>,
}

/// Why the model tripped or ended a run, to count how often each occurs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Cause {
    Check,
    Enable,
    Command,
    Heat,
    Signal,
    Lease,
    Completion,
}

/// A program that runs or waits.
#[derive(Clone, Copy, Debug)]
struct Run {
    load: Load,
    tick: u64,
}

/// The model.
pub struct Model {
    pub state: State,
    settings: RunSettings,
    heat: Heat,
    missed: Missed,
    is_clearing: bool,
    healthy: u64,
    has_begun: bool,
    run: Option<Run>,
    /// Ticks of the ramps so far, and the current in amperes that is left for the second ramp.
    settled: u64,
    left_a: f64,
    settling_ends: bool,
    last_requested_a: f64,
    signals: usize,
    lease_age: u64,
    pub causes: Vec<Cause>,
    pub accepted: Vec<bool>,
    /// How often enabling and resetting of the amplifier must have begun.
    pub begun: Begun,
}

/// How often enabling and resetting of the amplifier have begun.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Begun {
    pub enables: u64,
    pub resets: u64,
}

/// The thermal model of the motor: thermal' = (i^2 - thermal)/tau by the explicit Euler method.
#[derive(Clone, Copy, Debug)]
pub struct Heat {
    pub thermal_a2: f64,
    pub limit_a2: f64,
    share: f64,
    peak_a: f64,
    current_a: f64,
}

/// The missed ticks of the last second.
struct Missed {
    entries: VecDeque<(u64, u64)>,
    limit: u64,
    period_s: f64,
}

impl Model {
    pub fn new(config: &Config, settings: RunSettings) -> Model {
        Model {
            state: State::Disarmed,
            settings,
            heat: Heat::cold(config),
            missed: Missed {
                entries: VecDeque::new(),
                limit: u64::from(config.interlock.overruns_per_s),
                period_s: 1.0 / config.servo.rate_hz,
            },
            is_clearing: false,
            healthy: 0,
            has_begun: false,
            run: None,
            settled: 0,
            left_a: 0.0,
            settling_ends: false,
            last_requested_a: 0.0,
            signals: 0,
            lease_age: 0,
            causes: Vec::new(),
            accepted: Vec::new(),
            begun: Begun::default(),
        }
    }

    pub fn heat(&self) -> Heat {
        self.heat
    }

    /// Another run: the trip, the reset of the amplifier and the heat remain.
    pub fn exchange(&mut self) {
        if self.is_on() || self.state == State::Enabling {
            self.state = State::Disarmed;
        }
        self.missed.entries.clear();
        self.run = None;
        self.heat.current_a = 0.0;
        self.last_requested_a = 0.0;
        (self.signals, self.lease_age) = (0, 0);
    }

    /// One tick.
    pub fn tick(&mut self, inputs: &TickInputs, number: u64) -> Expected {
        self.accepted.clear();
        let faults = inputs.faults;
        self.poll_reset(faults);
        for order in &inputs.orders {
            let accepted = self.order(*order, faults);
            self.accepted.push(accepted);
        }
        self.signalled(inputs.signals);
        self.lease(inputs);
        let is_healthy = self.judge(faults, inputs.missed, number);
        self.enable(is_healthy, faults);
        if !is_healthy && self.state != State::Disarmed {
            self.trip(Cause::Check);
        }
        let expected = self.command(faults);
        self.end_tick();
        expected
    }

    fn is_on(&self) -> bool {
        matches!(self.state, State::Armed | State::Running | State::Settling)
    }

    fn runs(&self) -> bool {
        matches!(self.state, State::Running | State::Settling)
    }

    fn off(&mut self) {
        self.state = State::Disarmed;
        self.run = None;
    }

    fn trip(&mut self, cause: Cause) {
        if self.state != State::Tripped {
            self.causes.push(cause);
            self.state = State::Tripped;
            self.run = None;
        }
    }

    fn poll_reset(&mut self, faults: Faults) {
        if !self.is_clearing || faults.has(Fault::PendingReset) {
            return;
        }
        self.is_clearing = false;
        if !faults.has(Fault::FailedReset) {
            self.state = State::Disarmed;
        }
    }

    /// Whether the request is accepted.
    fn order(&mut self, order: Order, faults: Faults) -> bool {
        match order {
            Order::Arm if self.state == State::Disarmed => {
                (self.state, self.healthy, self.has_begun) = (State::Enabling, 0, false);
                true
            }
            Order::Start(load) => self.start(Run { load, tick: 0 }),
            Order::Finish => self.finish(),
            Order::Stop => {
                if self.state != State::Tripped {
                    self.off();
                }
                true
            }
            Order::Clear if self.state == State::Tripped => {
                if !self.is_clearing {
                    self.begin_reset(faults);
                }
                true
            }
            Order::Arm | Order::Clear | Order::Tune => false,
        }
    }

    fn begin_reset(&mut self, faults: Faults) {
        self.begun.resets += 1;
        if !faults.has(Fault::RefusedReset) {
            self.is_clearing = true;
            self.poll_reset(faults);
        }
    }

    fn start(&mut self, run: Run) -> bool {
        match self.state {
            State::Enabling if self.run.is_none() => self.run = Some(run),
            State::Armed => (self.run, self.state) = (Some(run), State::Running),
            _ => return false,
        }
        true
    }

    fn finish(&mut self) -> bool {
        match self.state {
            State::Running if self.settings.ramp_ticks > 0 && self.last_requested_a != 0.0 => {
                (self.settled, self.settling_ends) = (0, false);
                self.state = State::Settling;
            }
            State::Running | State::Armed | State::Enabling => self.off(),
            State::Settling | State::Disarmed | State::Tripped => return false,
        }
        true
    }

    /// The first signal of a run ends it along the ramps, the second one cuts the current, the others have no effect.
    fn signalled(&mut self, signals: usize) {
        for _ in 0..signals {
            self.signals += 1;
            match self.signals {
                1 => self.count_end(Cause::Signal, Model::finish),
                2 => self.count_end(Cause::Signal, |model| {
                    model.order(Order::Stop, Faults::default())
                }),
                _ => {}
            }
        }
    }

    fn count_end(&mut self, cause: Cause, end: impl Fn(&mut Model) -> bool) {
        let was_running = self.runs();
        if end(self) && was_running {
            self.causes.push(cause);
        }
    }

    fn lease(&mut self, inputs: &TickInputs) {
        self.lease_age = if inputs.renewed {
            0
        } else {
            self.lease_age + 1 + u64::from(inputs.missed)
        };
        if self.lease_age >= self.settings.lease_ticks {
            self.count_end(Cause::Lease, Model::finish);
        }
    }

    /// Whether the lease is valid, or the run already ends.
    pub fn is_supervised(&self) -> bool {
        self.lease_age < self.settings.lease_ticks || self.state == State::Settling
    }

    fn judge(&mut self, faults: Faults, missed: u32, number: u64) -> bool {
        let is_in_time = missed == 0 || {
            self.heat.rest(missed);
            self.missed.add(missed, number)
        };
        let is_disabled = faults.has(Fault::ReportsDisabled) && self.runs();
        let is_bad = [Fault::InvalidReading, Fault::Travel, Fault::FailedDrive];
        is_in_time && !is_disabled && !is_bad.iter().any(|fault| faults.has(*fault))
    }

    fn enable(&mut self, is_healthy: bool, faults: Faults) {
        if self.state != State::Enabling || !is_healthy {
            return;
        }
        self.healthy += 1;
        if self.healthy < self.settings.healthy_ticks {
            return;
        }
        if !self.has_begun {
            self.begun.enables += 1;
            if faults.has(Fault::RefusedEnable) {
                return self.trip(Cause::Enable);
            }
        }
        self.has_begun = true;
        if faults.has(Fault::PendingEnable) {
            return;
        }
        if faults.has(Fault::FailedEnable) {
            return self.trip(Cause::Enable);
        }
        self.state = match self.run {
            Some(_) => State::Running,
            None => State::Armed,
        };
    }

    /// What the program or the ramps request.
    fn requested_a(&mut self) -> f64 {
        match (self.state, self.run) {
            (State::Running, Some(run)) => run.load.current_a,
            (State::Settling, Some(run)) => self.settling_a(run.load),
            _ => 0.0,
        }
    }

    fn settling_a(&mut self, load: Load) -> f64 {
        let length = self.settings.ramp_ticks;
        self.settled += 1;
        if self.settled <= length {
            return if load.holds {
                load.current_a
            } else {
                load.current_a * ramp(self.settled, length)
            };
        }
        if self.settled == length + 1 {
            self.left_a = self.last_requested_a;
        }
        let tick = self.settled - length;
        self.settling_ends = tick >= length || self.left_a == 0.0;
        if self.settling_ends {
            0.0
        } else {
            self.left_a * ramp(tick, length)
        }
    }

    fn command(&mut self, faults: Faults) -> Expected {
        let requested_a = self.requested_a();
        self.last_requested_a = requested_a;
        let mut command_a = None;
        if self.is_on() {
            match self.heat.allows(requested_a) {
                Err(cause) => self.trip(cause),
                Ok(()) if faults.has(Fault::RefusedCommand) => self.trip(Cause::Command),
                Ok(()) => command_a = Some(requested_a),
            }
        }
        self.heat.current_a = command_a.unwrap_or(0.0);
        self.heat.rest(1);
        Expected {
            state: self.state,
            command_a,
        }
    }

    fn end_tick(&mut self) {
        match (self.state, &mut self.run) {
            (State::Running, Some(run)) => {
                run.tick += 1;
                if run.tick >= run.load.ticks {
                    self.count_end(Cause::Completion, Model::finish);
                }
            }
            (State::Settling, _) if self.settling_ends => self.off(),
            _ => {}
        }
    }
}

impl Heat {
    fn cold(config: &Config) -> Heat {
        let continuous_a = config.motor.continuous_current_a();
        Heat {
            thermal_a2: 0.0,
            limit_a2: continuous_a * continuous_a,
            share: 1.0 / config.servo.rate_hz / config.motor.thermal_time_constant_s,
            peak_a: config.motor.peak_current_a(),
            current_a: 0.0,
        }
    }

    /// The current of the last tick flows for `periods` more.
    fn rest(&mut self, periods: u32) {
        let share = (self.share * f64::from(periods)).min(1.0);
        self.thermal_a2 += share * (self.current_a * self.current_a - self.thermal_a2);
    }

    fn allows(&self, current_a: f64) -> Result<(), Cause> {
        let after_a2 = self.thermal_a2 + self.share * (current_a * current_a - self.thermal_a2);
        let is_within_peak = current_a.abs() <= self.peak_a;
        if !is_within_peak {
            Err(Cause::Command)
        } else if after_a2 <= self.limit_a2 {
            Ok(())
        } else {
            Err(Cause::Heat)
        }
    }
}

impl Missed {
    /// Whether at most the permitted number of ticks was missed within the last second.
    fn add(&mut self, missed: u32, number: u64) -> bool {
        let now_ns = (number as f64 * self.period_s * 1e9).round() as u64;
        self.entries.push_back((now_ns, u64::from(missed)));
        self.entries.retain(|(ns, _)| now_ns - ns <= 1_000_000_000);
        self.entries.iter().map(|(_, missed)| missed).sum::<u64>() <= self.limit
    }
}

/// The cycloid from 1 to 0.
fn ramp(tick: u64, ticks: u64) -> f64 {
    let x = tick as f64 / ticks as f64;
    if tick >= ticks {
        0.0
    } else {
        1.0 - x + (TAU * x).sin() / TAU
    }
}
