//! The loop with a rig that fails as a sequence says, and that notes what it was told in a tick.
use std::sync::{Arc, Mutex, MutexGuard};
use std::task::Poll;

use bench_config::Config;
use bench_hal::{
    AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, Reading, Tick, Validity,
};
use bench_rt::clock::{TickTiming, Virtual};
use bench_rt::interlock::Interlocks;
use bench_rt::program::{Decision, Program, ProgramInput};
use bench_rt::publisher::Publisher;
use bench_rt::record::{EventKind, LoopMessage, Origin, RequestEvent, TickRecord};
use bench_rt::request::RequestSender;
use bench_rt::servo::{Request, Servo};
use bench_rt::servo_run::{Connections, Progress, ServoRun};
use bench_rt::supervision::{ArmLease, LeaseWatch, StopFlags};
use bench_rt::tuning::{Factors, Tune};
use rtrb::{Consumer, RingBuffer};

use crate::state_machine::model::{Begun, RunSettings};
use crate::state_machine::sequence::{Fault, Faults, Load, Order, TickInputs};

/// What the amplifier was told in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Calls {
    /// The last accepted command in amperes.
    pub command_a: Option<f64>,
    /// Whether `disable` was the last call.
    pub ended_disabled: bool,
}

#[derive(Debug, Default)]
struct Shared {
    faults: Faults,
    is_enabled: bool,
    calls: Calls,
    begun: Begun,
}

/// A stage that moves by +-1 nm only.
#[derive(Clone, Default)]
struct TestRig {
    shared: Arc<Mutex<Shared>>,
    sequence: u64,
}

impl TestRig {
    fn shared(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().expect("no test panics with it")
    }
}

fn refusal() -> DeviceError {
    DeviceError {
        what: "the amplifier refuses",
        remedy: "this fault is injected by a test",
        code: 1,
    }
}

impl CurrentAmplifier for TestRig {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        let mut shared = self.shared();
        shared.begun.enables += 1;
        if shared.faults.has(Fault::RefusedEnable) {
            return Err(refusal());
        }
        shared.is_enabled = true;
        shared.calls.ended_disabled = false;
        Ok(())
    }

    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        let faults = self.shared().faults;
        if faults.has(Fault::PendingEnable) {
            return Poll::Pending;
        }
        Poll::Ready(if faults.has(Fault::FailedEnable) {
            Err(refusal())
        } else {
            Ok(())
        })
    }

    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        let mut shared = self.shared();
        if shared.faults.has(Fault::RefusedCommand) || !shared.is_enabled {
            return Err(refusal());
        }
        shared.calls = Calls {
            command_a: Some(current_a),
            ended_disabled: false,
        };
        Ok(current_a)
    }

    fn disable(&mut self) {
        let mut shared = self.shared();
        shared.is_enabled = false;
        shared.calls.ended_disabled = true;
    }

    fn begin_reset(&mut self) -> Result<(), DeviceError> {
        let mut shared = self.shared();
        shared.begun.resets += 1;
        if shared.faults.has(Fault::RefusedReset) {
            Err(refusal())
        } else {
            Ok(())
        }
    }

    fn poll_reset(&mut self) -> Poll<Result<(), DeviceError>> {
        let faults = self.shared().faults;
        if faults.has(Fault::PendingReset) {
            return Poll::Pending;
        }
        Poll::Ready(if faults.has(Fault::FailedReset) {
            Err(refusal())
        } else {
            Ok(())
        })
    }

    fn status(&self) -> AmplifierStatus {
        let shared = self.shared();
        if shared.faults.has(Fault::FailedDrive) {
            return AmplifierStatus::Fault(9);
        }
        if shared.is_enabled && !shared.faults.has(Fault::ReportsDisabled) {
            AmplifierStatus::Enabled
        } else {
            AmplifierStatus::Disabled
        }
    }
}

impl DisplacementProbe for TestRig {
    fn latest(&mut self, _now: Tick) -> Reading {
        let faults = self.shared().faults;
        self.sequence += 1;
        let rest_m = if self.sequence.is_multiple_of(2) {
            1e-9
        } else {
            -1e-9
        };
        Reading {
            position_m: if faults.has(Fault::Travel) {
                0.00095
            } else {
                rest_m
            },
            sequence: self.sequence,
            age_ns: 0,
            validity: if faults.has(Fault::InvalidReading) {
                Validity::Faulty
            } else {
                Validity::Valid
            },
        }
    }
}

/// A constant current.
struct Constant(Load);

impl Program for Constant {
    fn decide(&mut self, _input: &ProgramInput) -> Decision {
        Decision {
            requested_a: self.0.current_a,
            active: true,
            ..Decision::default()
        }
    }

    fn settle(&mut self, input: &ProgramInput, scale: f64) -> Decision {
        let decision = self.decide(input);
        let scale = if self.0.holds { 1.0 } else { scale };
        Decision {
            requested_a: scale * decision.requested_a,
            ..decision
        }
    }

    fn ticks(&self) -> u64 {
        self.0.ticks
    }
}

/// The outer ends of the rings of a run.
struct Outside {
    requests: RequestSender,
    published: Consumer<LoopMessage>,
    retired: Consumer<Box<dyn Program>>,
    lease: Arc<ArmLease>,
    flags: StopFlags,
}

/// What the loop did in a tick.
#[derive(Clone, Debug)]
pub struct Done {
    pub record: TickRecord,
    pub calls: Calls,
    /// The answers to requests of the supervisor.
    pub answers: Vec<RequestEvent>,
}

/// The loop, driven tick by tick.
pub struct TestLoop {
    config: Config,
    settings: RunSettings,
    rig: TestRig,
    servo: Servo,
    outside: Outside,
    clock: Virtual,
    next: u64,
    /// Number of requests of this run.
    sent: u64,
}

impl TestLoop {
    pub fn new(config: &Config, settings: RunSettings) -> TestLoop {
        let rig = TestRig::default();
        let (run, outside) = run(config, settings, 0.0);
        let period_s = config.servo.period_s();
        TestLoop {
            config: config.clone(),
            settings,
            servo: Servo::new(Box::new(rig.clone()), run, period_s),
            rig,
            outside,
            clock: Virtual { period_s },
            next: 0,
            sent: 0,
        }
    }

    /// Number of the tick that follows `missed` missed ticks.
    pub fn next_tick(&self, missed: u32) -> u64 {
        self.next + u64::from(missed)
    }

    /// Begins another run with a motor that is warm from the one before.
    pub fn exchange(&mut self) {
        let thermal_a2 = self.servo.run().outcome().thermal_a2;
        let (run, outside) = run(&self.config, self.settings, thermal_a2);
        self.servo.exchange(run);
        self.outside = outside;
        (self.next, self.sent) = (0, 0);
    }

    pub fn tick(&mut self, inputs: &TickInputs) -> Done {
        self.prepare(inputs);
        let number = self.next_tick(inputs.missed);
        let scheduled_ns = (number as f64 * self.clock.period_s * 1e9).round() as u64;
        let timing = TickTiming {
            tick: Tick {
                number,
                scheduled_ns,
            },
            woke_ns: scheduled_ns,
            missed: inputs.missed,
        };
        self.servo.tick(&timing, &self.clock);
        self.next = number + 1;
        while self.outside.retired.pop().is_ok() {}
        self.done()
    }

    fn prepare(&mut self, inputs: &TickInputs) {
        let mut shared = self.rig.shared();
        shared.faults = inputs.faults;
        shared.calls = Calls::default();
        drop(shared);
        for order in &inputs.orders {
            self.sent += 1;
            let number = self.outside.requests.send(request(*order)).ok();
            assert_eq!(number, Some(self.sent));
        }
        for _ in 0..inputs.signals {
            self.outside.flags.raise();
        }
        if inputs.renewed {
            self.outside.lease.renew();
        }
    }

    fn done(&mut self) -> Done {
        let (mut record, mut answers) = (None, Vec::new());
        while let Ok(message) = self.outside.published.pop() {
            match message {
                LoopMessage::Tick(tick) => record = Some(tick),
                LoopMessage::Event(event) => {
                    if let EventKind::Request(answer) = event.kind
                        && answer.origin == Origin::Supervisor
                    {
                        answers.push(answer);
                    }
                }
            }
        }
        Done {
            record: record.expect("every tick publishes its record"),
            calls: self.rig.shared().calls,
            answers,
        }
    }

    /// Number of requests of this run.
    pub fn sent(&self) -> u64 {
        self.sent
    }

    pub fn begun(&self) -> Begun {
        self.rig.shared().begun
    }

    pub fn amplifier_is_enabled(&self) -> bool {
        self.rig.shared().is_enabled
    }

    pub fn thermal_a2(&self) -> f64 {
        self.servo.run().outcome().thermal_a2
    }
}

fn run(config: &Config, settings: RunSettings, thermal_a2: f64) -> (Box<ServoRun>, Outside) {
    let (publisher, published) = RingBuffer::new(256);
    let (requests, taken) = RequestSender::ring(16);
    let (hand_back, retired) = RingBuffer::new(64);
    let interlocks = Interlocks::new(
        &config.interlock,
        &config.amplifier,
        &config.motor,
        &config.servo,
    );
    let connections = Connections {
        requests: taken,
        retired: hand_back,
        publisher: Publisher::new(publisher),
        progress: Arc::new(Progress::default()),
    };
    let (lease, flags) = (Arc::new(ArmLease::default()), StopFlags::default());
    let watch = LeaseWatch::new(Arc::clone(&lease), settings.lease_ticks);
    let run = ServoRun::new(interlocks.with_thermal_state(thermal_a2), connections)
        .with_ramps(settings.ramp_ticks)
        .with_healthy_ticks(settings.healthy_ticks)
        .with_stop_flags(flags.clone())
        .with_lease(Some(watch));
    let outside = Outside {
        requests,
        published,
        retired,
        lease,
        flags,
    };
    (Box::new(run), outside)
}

fn request(order: Order) -> Request {
    match order {
        Order::Arm => Request::Arm,
        Order::Start(load) => Request::Start(Box::new(Constant(load))),
        Order::Finish => Request::Finish,
        Order::Stop => Request::Stop,
        Order::Clear => Request::Clear,
        Order::Tune => Request::Tune(Tune::new(Factors::default(), 1).expect("valid factors")),
    }
}
