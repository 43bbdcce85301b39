//! The loop with its rings, driven tick by tick. The driver does not allocate either.
use std::ops::Range;
use std::sync::Arc;

use assert_no_alloc::assert_no_alloc;
use bench_config::Config;
use bench_rig::simulated::SimulatedRig;
use bench_rt::clock::{Clock, TickTiming, Virtual};
use bench_rt::interlock::Interlocks;
use bench_rt::program::{Decision, Program, ProgramInput};
use bench_rt::publisher::Publisher;
use bench_rt::record::{EventKind, LoopMessage};
use bench_rt::request::RequestSender;
use bench_rt::residual::Residuals;
use bench_rt::servo::{Request, Servo};
use bench_rt::servo_run::{Connections, Progress, ServoRun};
use rtrb::{Consumer, RingBuffer};

use crate::faulty_rig::{Fault, FaultyRig};
use crate::programs::NO_CURRENT;

/// A loop with its rings, and a summary of its messages.
pub struct TestLoop {
    pub servo: Servo,
    pub requests: RequestSender,
    records: Consumer<LoopMessage>,
    retired: Consumer<Box<dyn Program>>,
    pub clock: Virtual,
    next: u64,
    pub trip: Option<&'static str>,
    completed: bool,
    pub commands: u64,
}

impl TestLoop {
    pub fn new(config: &Config, faults: &[(Range<u64>, Fault)]) -> TestLoop {
        TestLoop::with_residuals(config, faults, None)
    }

    /// A loop whose position is compared with a model.
    pub fn with_residuals(
        config: &Config,
        faults: &[(Range<u64>, Fault)],
        residuals: Option<Residuals>,
    ) -> TestLoop {
        let rig = FaultyRig::new(SimulatedRig::new(config).expect("a rig"), faults);
        let (publisher, records) = RingBuffer::new(1024);
        let (requests, taken) = RequestSender::ring(16);
        let (hand_back, retired) = RingBuffer::new(4);
        let connections = Connections {
            requests: taken,
            retired: hand_back,
            publisher: Publisher::new(publisher),
            progress: Arc::new(Progress::default()),
        };
        let interlocks = Interlocks::new(
            &config.interlock,
            &config.amplifier,
            &config.motor,
            &config.servo,
        )
        .with_residuals(residuals);
        TestLoop {
            servo: Servo::new(
                Box::new(rig),
                Box::new(ServoRun::new(interlocks, connections)),
                config.servo.period_s(),
            ),
            requests,
            records,
            retired,
            clock: Virtual {
                period_s: config.servo.period_s(),
            },
            next: 0,
            trip: None,
            completed: false,
            commands: 0,
        }
    }

    pub fn running(
        config: &Config,
        faults: &[(Range<u64>, Fault)],
        program: Box<dyn Program>,
    ) -> TestLoop {
        let mut test_loop = TestLoop::new(config, faults);
        test_loop.request(Request::Arm);
        test_loop.request(Request::Start(program));
        test_loop
    }

    pub fn request(&mut self, request: Request) {
        assert!(self.requests.send(request).is_ok());
    }

    /// One tick of the loop, after `missed` missed ticks.
    pub fn bare_tick(&mut self, missed: u32) {
        let moment = self
            .clock
            .wait(self.next + u64::from(missed), self.servo.run().publisher());
        self.servo
            .tick(&TickTiming { missed, ..moment }, &self.clock);
        self.next = moment.tick.number + 1;
    }

    /// Reads the messages between two ticks, without an allocation.
    pub fn collect(&mut self) {
        while let Ok(published) = self.records.pop() {
            match published {
                LoopMessage::Tick(record) => self.commands += u64::from(record.command_a != 0.0),
                LoopMessage::Event(event) => match event.kind {
                    EventKind::Trip(trip) => self.trip = Some(trip.reason()),
                    EventKind::Completed => self.completed = true,
                    EventKind::Request(_)
                    | EventKind::State { .. }
                    | EventKind::ResetFailed { .. }
                    | EventKind::Override
                    | EventKind::Lost { .. }
                    | EventKind::Clock(_) => {}
                },
            }
        }
    }

    /// Whether the program completed and commanded a current (or none, if that is its purpose).
    pub fn has_done(&self, name: &str) -> bool {
        let commanded = if name == NO_CURRENT {
            self.commands == 0
        } else {
            self.commands > 3500
        };
        self.completed && commanded
    }

    pub fn run(&mut self, ticks: u64) {
        for _ in 0..ticks {
            assert_no_alloc(|| self.bare_tick(0));
            self.collect();
        }
        while self.retired.pop().is_ok() {}
    }
}

pub struct ConstantCurrent(pub f64);

impl Program for ConstantCurrent {
    fn decide(&mut self, _input: &ProgramInput) -> Decision {
        Decision {
            requested_a: self.0,
            active: true,
            ..Decision::default()
        }
    }
    fn ticks(&self) -> u64 {
        u64::MAX
    }
}
