//! The CANopen driver with the emulated drive and its stage, on a bus in memory and in virtual time: every run is identical.
use std::sync::Arc;
use std::time::Duration;

use bench::config::{Config, Source, load};
use bench::experiment::Plan;
use bench::rig::devices::Requirements;
use bench::rig::emulator::{AmplifierServer, EmulatedFault, EventLog, FaultRequest, Stage};
use bench::rt::arming::{State, Trip};
use bench::rt::program::Program;
use bench::rt::record::{EventKind, LoopMessage};
use bench::rt::servo::Request;
use bench_hal::can::bus::{Host, SimulatedHost};
use bench_hal::can::drive::faults::*;
use bench_hal::{CurrentAmplifier, Devices, DisplacementProbe, Reading, Tick, Validity};

use crate::rig::Bench;

/// A tick of the bench of these tests is a millisecond.
const PERIOD: Duration = Duration::from_millis(1);
/// From the tick that finds a fault to the drive's zero current: the frame that says so goes out in that tick.
const SWITCH_OFF: u64 = 2;
/// The drive misses us 70 ms after our last heartbeat, and looks every 0.1 ms.
const UNHEARD: u64 = 72;
/// Ticks watched after a fault.
const AFTER: u64 = 400;

/// What a fault promises.
struct Case {
    word: &'static str,
    /// While the amplifier is in use the loop trips within so many ticks, with this code.
    found: (u64, u32),
    /// The current is zero within so many ticks.
    zero: u64,
    /// Arming is refused with this code if the fault was there before; `None`: a drive that is off shows no trace of it.
    armed_into: Option<u32>,
}

const fn case(word: &'static str, found: (u64, u32), zero: u64, armed_into: Option<u32>) -> Case {
    Case {
        word,
        found,
        zero,
        armed_into,
    }
}

/// A status frame comes every 2 ms, and up to a tick passes until the loop looks.
const STATUS: u64 = 3;
/// A frame of its own, or an error frame: the tick that looks next, and one if it came in the middle of one.
const FRAME: u64 = 2;
/// No status frame for 20 ms.
const SILENCE: u64 = 22;

/// The table of `hal/README.md` in ticks of a millisecond.
const CASES: [Case; 12] = [
    case(
        "amplifier.silence",
        (SILENCE, STATUS_LOST),
        SILENCE + SWITCH_OFF,
        Some(HEARTBEAT_LOST),
    ),
    case(
        "amplifier.late=200ms",
        (SILENCE, STATUS_LOST),
        SILENCE + SWITCH_OFF,
        Some(HEARTBEAT_LOST),
    ),
    case(
        "amplifier.unplugged",
        (SILENCE, STATUS_LOST),
        UNHEARD,
        Some(HEARTBEAT_LOST),
    ),
    case(
        "amplifier.short-frames",
        (STATUS, MALFORMED),
        STATUS + SWITCH_OFF,
        Some(MALFORMED),
    ),
    case(
        "amplifier.senseless-status",
        (STATUS, MALFORMED),
        STATUS + SWITCH_OFF,
        Some(NOT_REMOTE),
    ),
    case(
        "amplifier.target-ignored",
        (STATUS, TARGET_IGNORED),
        0,
        Some(TARGET_IGNORED),
    ),
    case("amplifier.switches-off", (STATUS, SWITCHED_OFF), 0, None),
    case(
        "amplifier.fault=0x2310",
        (FRAME, EMERGENCY + 0x2310),
        0,
        Some(EMERGENCY + 0x2310),
    ),
    case(
        "amplifier.emergency=0x4210",
        (FRAME, EMERGENCY + 0x4210),
        FRAME + SWITCH_OFF,
        None,
    ),
    case("amplifier.reset", (FRAME, RESTARTED), 0, Some(RESTARTED)),
    case(
        "amplifier.bus-off",
        (FRAME, BUS_OFF),
        UNHEARD,
        Some(BUS_OFF),
    ),
    case(INTERFACE_DOWN, (FRAME, BUS_DOWN), UNHEARD, Some(BUS_DOWN)),
];

/// Not a fault of the device: the cable of the adapter.
const INTERFACE_DOWN: &str = "the interface is down";

fn config(more: &[&str]) -> Config {
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

/// Looks at the stage at every tick, and lets a tick's time pass first.
struct Look {
    world: SimulatedHost,
    stage: Stage,
    due_ns: u64,
    sequence: u64,
}

impl DisplacementProbe for Look {
    fn latest(&mut self, _now: Tick) -> Reading {
        // An order that took its time begins the schedule anew.
        self.due_ns = (self.due_ns + PERIOD.as_nanos() as u64).max(self.world.now_ns());
        self.world
            .sleep(Duration::from_nanos(self.due_ns - self.world.now_ns()));
        self.sequence += 1;
        let position_m = self.stage.position_m(self.world.now_ns());
        Reading {
            position_m,
            sequence: self.sequence,
            age_ns: 0,
            validity: Validity::Valid,
        }
    }
}

/// The loop with the driver on one end of a bus, drive and stage on the other.
struct Lab {
    bench: Bench,
    drive: AmplifierServer,
    stage: Stage,
    world: SimulatedHost,
    config: Config,
}

/// The driver, opened on the bus.
fn driver(config: &Config, world: &SimulatedHost) -> Box<dyn CurrentAmplifier> {
    let device = config.amplifier.device.can().expect("a real device");
    let requirements = Requirements::new(&config.amplifier, &config.servo);
    let opened = device.open(requirements, Box::new(world.clone()));
    opened.expect("it opens").0
}

/// The driver in a loop that is disarmed.
fn open(config: &Config, world: &SimulatedHost, stage: &Stage) -> Bench {
    let amplifier = driver(config, world);
    let probe = Look {
        world: world.clone(),
        stage: stage.clone(),
        due_ns: world.now_ns(),
        sequence: 0,
    };
    Bench::around(config, Devices { amplifier, probe })
}

impl Lab {
    fn new() -> Lab {
        Lab::of(config(&[]))
    }

    fn of(config: Config) -> Lab {
        let world = SimulatedHost::default();
        let stage = Stage::new(&config).expect("a stage");
        let (log, _) = EventLog::new();
        let drive = AmplifierServer::start(
            &config.amplifier.device,
            Arc::new(world.clone()),
            stage.clone(),
            log,
        )
        .expect("a drive");
        let bench = open(&config, &world, &stage);
        Lab {
            bench,
            drive,
            stage,
            world,
            config,
        }
    }

    /// Armed, nothing running.
    fn arm(&mut self) {
        self.bench.order(Request::Arm);
        self.bench.run(50);
        assert_eq!(
            self.bench.state(),
            State::Armed,
            "{:x?}",
            self.bench.trips()
        );
        assert!(self.drive.is_enabled());
    }

    /// No current, and none could flow. A VESC has no such state: it holds at zero until nobody commands any more.
    fn is_off(&self) -> bool {
        self.drive.current_a() == 0.0 && (self.drive.kind() == "vesc" || !self.drive.is_enabled())
    }

    /// Running, until a current flows that is worth stopping.
    fn run_until_current_flows(&mut self, run: Run) {
        self.arm();
        self.bench.order(Request::Start(program(&self.config, run)));
        for _ in 0..2000 {
            self.bench.tick();
            if self.drive.current_a().abs() > 0.02 {
                return;
            }
        }
        panic!("no current flows: {:?}", self.bench.trips());
    }

    fn begin(&mut self, word: &str) {
        match word {
            INTERFACE_DOWN => self.world.bus().set_down(true),
            word => self.ask(word),
        }
    }

    fn end(&mut self) {
        self.world.bus().set_down(false);
        self.ask("amplifier.none");
        self.bench.run(300);
    }

    fn ask(&self, word: &str) {
        let request: FaultRequest = word.parse().expect("a fault");
        let EmulatedFault::Amplifier(fault) = request.fault else {
            panic!("{word} is not a fault of the amplifier")
        };
        self.drive.inject(fault).expect("a bus in memory takes it");
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

    /// Of the next `ticks`, the last in which the drive gives a current or would.
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

    /// Of the next `ticks`, the last in which the drive gives a current.
    fn ticks_with_current(&mut self, ticks: u64) -> u64 {
        (1..=ticks)
            .filter(|_| {
                self.bench.tick();
                self.drive.current_a() != 0.0
            })
            .max()
            .unwrap_or(0)
    }

    fn trips_naming(&self, code: u32, at: std::ops::RangeInclusive<u64>) {
        let (trip, tick) = self.trip().expect("it trips");
        let names = |trip: &Trip| matches!(*trip, Trip::Amplifier { code: found, .. } if found == i64::from(code));
        assert!(names(&trip), "0x{code:x}: {trip:?}");
        assert!(at.contains(&tick), "tick {tick}, {at:?} was promised");
        self.bench
            .prove_that_the_recording_is_complete(tick, "amplifier");
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

    /// A person removes the cause and clears the trip, and runs again.
    fn next_run_completes(&mut self) {
        self.end();
        let clearing = if self.bench.state() == State::Tripped {
            Request::Clear
        } else {
            Request::Stop
        };
        self.bench.order(clearing);
        self.bench.run(100);
        self.run_completes();
    }

    /// The program ends, and the next one opens the drive anew.
    fn next_program_completes(mut self) {
        self.end();
        let Lab {
            bench,
            drive,
            stage,
            world,
            config,
        } = self;
        drop(bench);
        let bench = open(&config, &world, &stage);
        let mut next = Lab {
            bench,
            drive,
            stage,
            world,
            config,
        };
        if next.drive.state() == "fault" {
            next.a_fault_of_the_drive_outlives_the_program();
        }
        next.run_completes();
    }

    /// Nothing but a person's order clears it: a new program is refused as well.
    fn a_fault_of_the_drive_outlives_the_program(&mut self) {
        self.bench.run(10);
        self.bench.order(Request::Arm);
        self.bench.run(1);
        self.trips_naming(DRIVE_FAULT, 10..=10);
        self.bench.order(Request::Clear);
        self.bench.run(100);
    }

    fn run_completes(&mut self) {
        assert!(self.is_off(), "neither cleared nor opened is armed");
        let trips = self.bench.trips().len();
        let mut config = self.config.clone();
        config.control.duration_s = 0.3;
        self.arm();
        self.bench
            .order(Request::Start(program(&config, Run::Control)));
        self.bench.run(450);
        assert_eq!(self.bench.trips().len(), trips, "{:x?}", self.trip());
        assert!(self.bench.servo().completed() && self.is_off());
    }
}

#[test]
fn with_sound_devices_nothing_trips_and_runs_complete() {
    for run in [Run::Chirp, Run::Control] {
        let mut lab = Lab::new();
        lab.run_until_current_flows(run);
        lab.bench.run(1000);
        assert_eq!(lab.bench.trips(), []);
        assert_eq!(lab.bench.state(), State::Running);
        lab.next_run_completes();
    }
}

#[test]
fn in_the_middle_of_a_run_every_fault_ends_the_current_in_time_and_is_recorded_and_the_next_run_is_clean()
 {
    for run in [Run::Chirp, Run::Control] {
        for case in &CASES {
            let mut lab = Lab::new();
            lab.run_until_current_flows(run);
            let begin = lab.last_tick();
            lab.begin(case.word);
            let zero = lab.ticks_with_current(AFTER);
            assert!(
                zero <= case.zero,
                "{}: current for {zero} ticks, {} are allowed",
                case.word,
                case.zero
            );
            assert!(
                !lab.drive.is_enabled(),
                "{}: {}",
                case.word,
                lab.drive.state()
            );
            lab.trips_naming(case.found.1, begin..=begin + case.found.0);
            match run {
                Run::Chirp => lab.next_run_completes(),
                Run::Control => lab.next_program_completes(),
            }
        }
    }
}

#[test]
fn armed_every_fault_switches_the_amplifier_off_in_time() {
    for case in &CASES {
        let mut lab = Lab::new();
        lab.arm();
        let begin = lab.last_tick();
        lab.begin(case.word);
        let off = lab.ticks_enabled(AFTER);
        let allowed = case.zero.max(case.found.0 + SWITCH_OFF);
        assert!(
            off <= allowed,
            "{}: enabled for {off} ticks, {allowed} are allowed",
            case.word
        );
        lab.trips_naming(case.found.1, begin..=begin + case.found.0);
        lab.next_run_completes();
    }
}

#[test]
fn disarmed_a_fault_gives_no_current_and_keeps_the_bench_from_starting_into_it() {
    for case in &CASES {
        let mut lab = Lab::new();
        lab.bench.run(50);
        lab.begin(case.word);
        assert_eq!(lab.ticks_enabled(AFTER), 0, "{}", case.word);
        assert_eq!(lab.bench.state(), State::Disarmed);
        let begin = lab.last_tick();
        lab.bench.order(Request::Arm);
        lab.bench
            .order(Request::Start(program(&lab.config, Run::Chirp)));
        // 50 ms of quiet come first: what is there is found before a current flows.
        assert_eq!(lab.ticks_with_current(50), 0, "{}", case.word);
        match case.armed_into {
            Some(code) => {
                lab.trips_naming(code, begin..=begin + 40);
                assert_eq!(
                    lab.ticks_enabled(AFTER),
                    0,
                    "{}: {}",
                    case.word,
                    lab.drive.state()
                );
            }
            None => assert_eq!(lab.bench.trips(), [], "{}", case.word),
        }
        lab.next_run_completes();
    }
}

#[test]
fn the_same_fault_is_the_same_run_bit_for_bit() {
    let run = || {
        let mut lab = Lab::new();
        lab.run_until_current_flows(Run::Control);
        lab.begin("amplifier.silence");
        lab.bench.run(AFTER);
        lab.bench
            .all
            .iter()
            .map(|published| format!("{published:?}"))
            .collect::<Vec<_>>()
    };
    assert_eq!(run(), run());
}

#[test]
fn a_drive_that_ignores_its_switching_off_is_stopped_by_nmt_and_one_that_ignores_that_by_our_silence()
 {
    // 70 ms without confirmation and a repeat of 10 ms: NMT stop; 70 ms later the drive misses our heartbeat.
    for (word, off) in [
        ("amplifier.set-points-ignored", 85),
        ("amplifier.orders-ignored", 175),
    ] {
        let mut lab = Lab::new();
        lab.run_until_current_flows(Run::Chirp);
        lab.begin(word);
        lab.bench.order(Request::Stop);
        let zero = lab.ticks_with_current(AFTER);
        assert!(
            (60..=off).contains(&zero),
            "{word}: current for {zero} ticks"
        );
        assert!(!lab.drive.is_enabled());
        lab.bench.order(Request::Arm);
        lab.bench.run(1);
        let at = lab.last_tick();
        lab.trips_naming(STILL_ENABLED, at..=at);
        lab.next_run_completes();
    }
}

#[test]
fn a_drive_that_keeps_its_last_current_in_the_middle_of_a_run_is_found_by_what_it_measures() {
    for run in [Run::Chirp, Run::Control] {
        let mut lab = Lab::new();
        lab.run_until_current_flows(run);
        lab.ask("amplifier.set-points-ignored");
        let asked = lab.last_tick();
        // Two windows of 50 ms at 1 kHz, the status's 2 ms, and the time until commands differ by 0.1 A; then off by NMT.
        let flowed = lab.ticks_with_current(1500);
        let (trip, tick) = lab.trip().expect("it trips");
        assert!(
            matches!(trip, Trip::CurrentNotFollowed { .. }),
            "{run:?}: {trip:?}"
        );
        assert!(
            tick - asked <= 1000 && flowed <= tick - asked + 85,
            "{run:?}: {} ticks, {flowed}",
            tick - asked
        );
    }
}

#[test]
fn a_loop_that_dies_leaves_no_current() {
    let mut lab = Lab::new();
    lab.run_until_current_flows(Run::Control);
    let Lab {
        bench,
        drive,
        world,
        ..
    } = lab;
    assert!(matches!(bench.all.last(), Some(LoopMessage::Tick(_))));
    drop(bench);
    world.sleep(Duration::from_millis(2));
    assert!(
        drive.current_a() == 0.0 && !drive.is_enabled(),
        "{}",
        drive.state()
    );
}

/// A VESC, whose codes are 1: silent, 2: bus-off, 3: interface down. STATUS is missed after 100 ms, and comes every 20 ms;
/// commands are missed by the VESC itself after 500 ms.
const VESC: &str =
    "amplifier.device={ kind = \"vesc\", interface = \"can0\", bit_rate = 500000, node = 23 }";

#[test]
fn a_vesc_loses_its_current_in_time_with_every_fault_in_every_state_and_runs_again() {
    let cases = [
        ("amplifier.silence", (122, 1), 122 + SWITCH_OFF),
        ("amplifier.short-frames", (122, 1), 122 + SWITCH_OFF),
        ("amplifier.late=400ms", (122, 1), 122 + SWITCH_OFF),
        ("amplifier.unplugged", (122, 1), 502),
        ("amplifier.bus-off", (FRAME, 2), 502),
        (INTERFACE_DOWN, (FRAME, 3), 502),
    ];
    for (word, (found, code), zero) in cases {
        for run in [None, Some(Run::Chirp), Some(Run::Control)] {
            let mut lab = Lab::of(config(&[VESC]));
            match run {
                Some(run) => lab.run_until_current_flows(run),
                None => lab.arm(),
            }
            let begin = lab.last_tick();
            lab.begin(word);
            let ticks = lab.ticks_with_current(600);
            assert!(
                ticks <= zero,
                "{word}: current for {ticks} ticks, {zero} are allowed"
            );
            lab.trips_naming(code, begin..=begin + found);
            lab.end();
            lab.bench.run(200); // what was held back comes late
            lab.next_run_completes();
        }
    }
}
