//! The drivers of amplifiers with the emulated device and its stage, on a bus in memory and in simulated time: every run is
//! identical.
mod canopen;
mod vesc;

use std::sync::Arc;
use std::time::Duration;

use bench_config::{Config, Source, load};
use bench_experiment::Plan;
use bench_hal::can::bus::{Host, SimulatedHost};
use bench_hal::can::drive::faults::*;
use bench_hal::{CurrentAmplifier, Devices, DisplacementProbe, Reading, Tick, Validity};
use bench_rig::devices::deferred::OutputTiming;
use bench_rig::devices::{Requirements, can_amplifier};
use bench_rig::emulator::{AmplifierServer, EmulatedFault, EventLog, FaultRequest, Stage};
use bench_rt::arming::{State, Trip};
use bench_rt::program::Program;
use bench_rt::record::{EventKind, LoopMessage};
use bench_rt::servo::Request;

use crate::devices::rig::Bench;

/// A tick of the bench of these tests is a millisecond.
const PERIOD: Duration = Duration::from_millis(1);
/// Ticks from the detection of a fault to zero current: the frame that switches off is sent in the tick of the detection.
const SWITCH_OFF: u64 = 2;
/// The drive detects the loss 70 ms after the last heartbeat of the driver; it checks every 0.1 ms.
const UNHEARD: u64 = 72;
/// Ticks observed after a fault.
const AFTER: u64 = 400;

/// Ticks until a frame or an error frame is noticed: the next tick, and one more if it arrived during a tick.
const FRAME: u64 = 2;

/// Not a fault of the device: the cable of the adapter.
const INTERFACE_DOWN: &str = "the interface is down";

pub fn config(more: &[&str]) -> Config {
    let sets = [
        "chirp.quiet_before_s=0.05",
        "chirp.fade_in_s=0.05",
        "chirp.fade_out_s=0.05",
        "chirp.quiet_after_s=0.05",
        "chirp.duration_s=3.0",
        "chirp.start_hz=2.0",
        "chirp.stop_hz=8.0",
        "control.settle_s=0.05",
        "control.reference={ kind = \"sine\", amplitude_m = 30e-6, frequency_hz = 2.0 }",
    ];
    let source = Source {
        config: Some("lab".into()),
        sets: sets.iter().chain(more).map(|set| set.to_string()).collect(),
        ..Source::default()
    };
    load(&source).expect("the profile is valid")
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Run {
    Chirp,
    Control,
}

fn program(config: &Config, run: Run) -> Box<dyn Program> {
    let plan = match run {
        Run::Chirp => Plan::chirp(config.clone()),
        Run::Control => Plan::control(config.clone()).expect("a plan"),
    };
    plan.program().expect("a program")
}

/// A probe without error, which first advances the simulated time by a tick.
struct IdealProbe {
    host: SimulatedHost,
    stage: Stage,
    due_ns: u64,
    sequence: u64,
}

impl DisplacementProbe for IdealProbe {
    fn latest(&mut self, _now: Tick) -> Reading {
        // A slow request restarts the schedule.
        self.due_ns = (self.due_ns + PERIOD.as_nanos() as u64).max(self.host.now_ns());
        self.host
            .sleep(Duration::from_nanos(self.due_ns - self.host.now_ns()));
        self.sequence += 1;
        let position_m = self.stage.position_m(self.host.now_ns());
        Reading {
            position_m,
            sequence: self.sequence,
            age_ns: 0,
            validity: Validity::Valid,
        }
    }
}

/// The loop with the driver on one end of a bus, drive and stage on the other.
pub struct Lab {
    bench: Bench,
    drive: AmplifierServer,
    stage: Stage,
    host: SimulatedHost,
    config: Config,
}

/// The driver, opened on the bus.
fn driver(config: &Config, host: &SimulatedHost) -> Box<dyn CurrentAmplifier> {
    let device = can_amplifier(&config.amplifier.device).expect("a real device");
    let requirements = Requirements::new(&config.amplifier, &config.servo);
    let opened = device.open(requirements, Box::new(host.clone()));
    opened.expect("it opens").0
}

/// The driver in a loop that is disarmed.
fn open(config: &Config, host: &SimulatedHost, stage: &Stage) -> Bench {
    open_with_timing(config, host, stage, OutputTiming::SameTick)
}

fn open_with_timing(
    config: &Config,
    host: &SimulatedHost,
    stage: &Stage,
    timing: OutputTiming,
) -> Bench {
    let amplifier = driver(config, host);
    let probe = IdealProbe {
        host: host.clone(),
        stage: stage.clone(),
        due_ns: host.now_ns(),
        sequence: 0,
    };
    Bench::around(config, timing.apply(Devices { amplifier, probe }))
}

impl Lab {
    fn new() -> Lab {
        Lab::of(config(&[]))
    }

    fn of(config: Config) -> Lab {
        Lab::with_timing(config, OutputTiming::SameTick)
    }

    pub fn with_timing(config: Config, timing: OutputTiming) -> Lab {
        let host = SimulatedHost::default();
        let stage = Stage::new(&config).expect("a stage");
        let (log, _) = EventLog::new();
        let drive = AmplifierServer::start(
            &config.amplifier.device,
            Arc::new(host.clone()),
            stage.clone(),
            log,
        )
        .expect("a drive");
        let bench = open_with_timing(&config, &host, &stage, timing);
        Lab {
            bench,
            drive,
            stage,
            host,
            config,
        }
    }

    pub fn bench(&mut self) -> &mut Bench {
        &mut self.bench
    }

    pub fn host(&self) -> &SimulatedHost {
        &self.host
    }

    /// Armed, nothing running.
    pub fn arm(&mut self) {
        self.bench.request(Request::Arm);
        self.bench.run(50);
        assert_eq!(
            self.bench.state(),
            State::Armed,
            "{:x?}",
            self.bench.trips()
        );
        assert!(self.drive.is_enabled());
    }

    /// Whether no current can flow. A VESC has no such state: it stays enabled at zero current as long as it receives commands.
    fn is_off(&self) -> bool {
        self.drive.current_a() == 0.0 && (self.drive.kind() == "vesc" || !self.drive.is_enabled())
    }

    /// Runs until a current flows.
    fn run_until_current_flows(&mut self, run: Run) {
        self.arm();
        self.bench
            .request(Request::Start(program(&self.config, run)));
        for _ in 0..2000 {
            self.bench.tick();
            if self.drive.current_a().abs() > 0.02 {
                return;
            }
        }
        panic!("no current flows: {:?}", self.bench.trips());
    }

    fn begin_fault(&mut self, fault: &str) {
        match fault {
            INTERFACE_DOWN => self.host.bus().set_down(true),
            fault => self.inject(fault),
        }
    }

    fn end_fault(&mut self) {
        self.host.bus().set_down(false);
        self.inject("amplifier.none");
        self.bench.run(300);
    }

    fn inject(&self, fault: &str) {
        let request: FaultRequest = fault.parse().expect("a fault");
        let EmulatedFault::Amplifier(fault) = request.fault else {
            panic!("{fault} is not a fault of the amplifier")
        };
        self.drive
            .inject(fault)
            .expect("a bus in memory accepts it");
    }

    fn trip(&self) -> Option<(Trip, u64)> {
        self.bench.trips().last().map(|event| {
            let EventKind::Trip(trip) = event.kind else {
                unreachable!()
            };
            (trip, event.tick)
        })
    }

    fn last_tick(&self) -> u64 {
        self.bench.ticks().last().map_or(0, |record| record.tick)
    }

    /// The last of the next `ticks` in which the drive gives a current or is enabled.
    fn ticks_enabled(&mut self, ticks: u64) -> u64 {
        let mut off = 0;
        for tick in 1..=ticks {
            self.bench.tick();
            if self.drive.current_a() != 0.0 || self.drive.is_enabled() {
                off = tick;
            }
        }
        off
    }

    /// The last of the next `ticks` in which the drive gives a current.
    fn ticks_with_current(&mut self, ticks: u64) -> u64 {
        (1..=ticks)
            .filter(|_| {
                self.bench.tick();
                self.drive.current_a() != 0.0
            })
            .max()
            .unwrap_or(0)
    }

    fn assert_trip_with_code(&self, code: u32, at: std::ops::RangeInclusive<u64>) {
        let (trip, tick) = self.trip().expect("it trips");
        let names = |trip: &Trip| matches!(*trip, Trip::Amplifier { code: found, .. } if found == i64::from(code));
        assert!(names(&trip), "0x{code:x}: {trip:?}");
        assert!(at.contains(&tick), "tick {tick}, {at:?} is required");
        self.bench.assert_recording_complete(tick, "amplifier");
        let (_folder, recording) = self.bench.recorded();
        assert!(
            recording
                .events()
                .iter()
                .any(|event| matches!(&event.kind, EventKind::Trip(trip) if names(trip))),
            "with its code"
        );
        let mut ticks = recording
            .ticks()
            .expect("readable")
            .map(|record| record.expect("readable"));
        assert!(ticks.all(|record| record.tick < tick || record.command_a.to_bits() == 0));
    }

    /// The operator removes the cause, clears the trip, and runs again.
    fn assert_next_run_completes(&mut self) {
        self.end_fault();
        let clearing = if self.bench.state() == State::Tripped {
            Request::Clear
        } else {
            Request::Stop
        };
        self.bench.request(clearing);
        self.bench.run(100);
        self.assert_run_completes();
    }

    /// The program ends, and the next program opens the drive again.
    fn assert_next_program_completes(mut self) {
        self.end_fault();
        let Lab {
            bench,
            drive,
            stage,
            host,
            config,
        } = self;
        drop(bench);
        let bench = open(&config, &host, &stage);
        let mut next = Lab {
            bench,
            drive,
            stage,
            host,
            config,
        };
        if next.drive.state() == "fault" {
            next.assert_drive_fault_persists();
        }
        next.assert_run_completes();
    }

    /// Only a request of the operator clears a fault of the drive: a new program is refused as well.
    fn assert_drive_fault_persists(&mut self) {
        self.bench.run(10);
        self.bench.request(Request::Arm);
        self.bench.run(1);
        self.assert_trip_with_code(DRIVE_FAULT, 10..=10);
        self.bench.request(Request::Clear);
        self.bench.run(100);
    }

    fn assert_run_completes(&mut self) {
        assert!(
            self.is_off(),
            "the amplifier is off after clear and after opening"
        );
        let trips = self.bench.trips().len();
        let mut config = self.config.clone();
        config.control.duration_s = 0.3;
        self.arm();
        self.bench
            .request(Request::Start(program(&config, Run::Control)));
        self.bench.run(450);
        assert_eq!(self.bench.trips().len(), trips, "{:x?}", self.trip());
        assert!(self.bench.outcome().completed && self.is_off());
    }
}
