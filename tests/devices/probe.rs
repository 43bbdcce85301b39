//! The serial driver with the emulated probe and its stage over a pseudo terminal, in real time, at about 200 Hz. While
//! readings arrive, each one starts a tick, so that a loaded machine slows the test down and does not fail it. The tests check
//! which interlock trips, not when.
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::Poll;
use std::time::{Duration, Instant};

use bench_config::{Config, Source, load};
use bench_experiment::Plan;
use bench_hal::serial::StatisticsHandle;
use bench_hal::{AmplifierStatus, CurrentAmplifier, DeviceError, Devices};
use bench_rig::devices;
use bench_rig::emulator::{EmulatedFault, FaultRequest, ProbeEndpoint, ProbeServer, Stage};
use bench_rt::arming::State;
use bench_rt::program::Program;
use bench_rt::record::EventKind;
use bench_rt::servo::Request;

use crate::devices::rig::Bench;

const PERIOD: Duration = Duration::from_millis(5);
/// Number of ticks within which a fault must trip and a current must flow: several times the longest time in the settings below.
const TICKS: u64 = 2000;
/// A test that waits longer than this has failed.
const TIME_LIMIT: Duration = Duration::from_secs(120);

/// Lines of text, two millimetres to either side: a damaged byte spoils the line, and a jump of a millimetre is in range.
fn ascii(folder: &std::path::Path) -> String {
    let line = format!(
        "{{ port = {:?}, baud = 115200, lock_folder = {folder:?} }}",
        folder.join("probe")
    );
    format!(
        "{{ kind = \"ascii\", line = {line}, mounting = {{ gain = 1.0, offset_m = 0.0 }}, pattern = \"{{value:9.5}}\", \
         unit_m = 1e-3, lower_m = -2e-3, upper_m = 2e-3 }}"
    )
}

/// The profile `lab` with a slow loop and long time limits.
fn config(folder: &std::path::Path, stale_s: f64) -> Config {
    // The test of one interlock must not trigger the other one.
    let stuck_s = if stale_s < LONG_STALE_S {
        2.0 * stale_s
    } else {
        1.5
    };
    let controller = folder.join("slow.toml");
    // 154 um/A below the first mode: crossover at 1.5 rad/s, far below everything that moves.
    let text = "title = \"slow\"\n[[section]]\nkind = \"integrator\"\ngain_a_per_um = 0.01\n";
    std::fs::write(&controller, text).expect("a file");
    let sets = [
        "loop.rate_hz=200".into(),
        format!("interlock.probe_stale_s={stale_s}"),
        format!("interlock.probe_stuck_s={stuck_s}"),
        "interlock.probe_stuck_current_a=0.1".into(),
        "interlock.overruns_per_s=1000000".into(),
        "probe.rate_hz=200".into(),
        "probe.transport_s=0.002".into(),
        format!("probe.device={}", ascii(folder)),
        "chirp.quiet_before_s=0.1".into(),
        "chirp.fade_in_s=0.1".into(),
        "chirp.fade_out_s=0.1".into(),
        "chirp.quiet_after_s=0.1".into(),
        "chirp.duration_s=30.0".into(),
        "chirp.start_hz=0.5".into(),
        "chirp.stop_hz=2.0".into(),
        "chirp.amplitude=[{ frequency_hz = 1.0, current_a = 0.2 }]".into(),
        format!("control.controller={controller:?}"),
        "control.settle_s=0.1".into(),
        "control.duration_s=30.0".into(),
        "control.reference={ kind = \"sine\", amplitude_m = 300e-6, frequency_hz = 0.5 }".into(),
    ];
    let source = Source {
        config: Some("lab".into()),
        sets: sets.to_vec(),
        ..Source::default()
    };
    load(&source).expect("the settings are valid")
}

/// An amplifier that moves the stage and never fails.
struct IdealAmplifier {
    stage: Stage,
    start: Instant,
    current_a: Arc<AtomicU64>,
    is_on: bool,
}

impl IdealAmplifier {
    fn set_current(&mut self, current_a: f64) {
        self.stage
            .command(self.start.elapsed().as_nanos() as u64, current_a);
        self.current_a.store(current_a.to_bits(), Ordering::Relaxed);
    }
}

impl CurrentAmplifier for IdealAmplifier {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        self.is_on = true;
        Ok(())
    }
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        Poll::Ready(Ok(()))
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        assert!(
            self.is_on,
            "the loop commands an amplifier that is switched off"
        );
        self.set_current(current_a);
        Ok(current_a)
    }
    fn disable(&mut self) {
        self.is_on = false;
        self.set_current(0.0);
    }
    fn status(&self) -> AmplifierStatus {
        if self.is_on {
            AmplifierStatus::Enabled
        } else {
            AmplifierStatus::Disabled
        }
    }
}

/// When the loop ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pace {
    /// With every reading.
    Readings,
    /// After every period, because there are no readings.
    Time,
}

/// The loop with the serial driver, the emulated probe at the other end, and the stage between both.
struct ProbeRig {
    bench: Bench,
    statistics: StatisticsHandle,
    probe: Option<ProbeServer>,
    stage: Stage,
    start: Instant,
    pace: Pace,
    published: u64,
    current_a: Arc<AtomicU64>,
    config: Config,
    _folder: Arc<tempfile::TempDir>,
}

impl ProbeRig {
    fn new(stale_s: f64) -> ProbeRig {
        let folder = Arc::new(tempfile::tempdir().expect("a temporary folder"));
        let (config, start) = (config(folder.path(), stale_s), Instant::now());
        let stage = Stage::new(&config).expect("a stage");
        ProbeRig::around(config, stage, start, folder)
    }

    fn around(
        config: Config,
        stage: Stage,
        start: Instant,
        folder: Arc<tempfile::TempDir>,
    ) -> ProbeRig {
        let end = ProbeEndpoint::Terminal(Some(folder.path().join("probe")));
        let now_ns = move || start.elapsed().as_nanos() as u64;
        let server = ProbeServer::start(&config, &end, None, stage.clone(), now_ns)
            .expect("a pseudo terminal");
        let current_a = Arc::<AtomicU64>::default();
        let amplifier = IdealAmplifier {
            stage: stage.clone(),
            start,
            current_a: Arc::clone(&current_a),
            is_on: false,
        };
        let probe =
            devices::probe::open(&config.probe, config.servo.priority).expect("the emulated probe");
        let statistics = probe.statistics_handle();
        let bench = Bench::around(&config, Devices { amplifier, probe });
        let (probe, pace, published, _folder) = (Some(server), Pace::Readings, 0, folder);
        let mut rig = ProbeRig {
            bench,
            statistics,
            probe,
            stage,
            start,
            pace,
            published,
            current_a,
            config,
            _folder,
        };
        rig.run(10);
        rig
    }

    /// The next tick: with the next reading, or after a period.
    fn tick(&mut self) {
        match self.pace {
            Pace::Readings => self.wait_for_a_reading(),
            Pace::Time => std::thread::sleep(PERIOD),
        }
        self.bench.tick();
    }

    fn wait_for_a_reading(&mut self) {
        let begun = Instant::now();
        while self.statistics.statistics().published == self.published {
            assert!(
                begun.elapsed() < TIME_LIMIT,
                "no readings: {:?}",
                self.statistics.statistics()
            );
            std::thread::sleep(Duration::from_millis(1));
        }
        self.published = self.statistics.statistics().published;
    }

    fn run(&mut self, ticks: u64) {
        (0..ticks).for_each(|_| self.tick());
    }

    fn inject(&self, fault: &str) {
        let request: FaultRequest = fault.parse().expect("a fault");
        let EmulatedFault::Probe(fault) = request.fault else {
            panic!("{fault} is not a fault of the probe")
        };
        let probe = self.probe.as_ref().expect("the probe is connected");
        probe.inject(fault);
    }

    /// Measurements of the probe since it was started.
    fn measurements(&self) -> u64 {
        let probe = self.probe.as_ref().expect("the probe is connected");
        probe.counts().measurements.load(Ordering::Relaxed)
    }

    /// The fault begins. The pace depends on whether readings still arrive.
    fn begin_fault(&mut self, fault: &str) {
        let silent = [
            "probe.silence",
            "probe.corrupt",
            LATE_ANSWERS,
            TERMINAL_CLOSED,
        ];
        self.pace = if silent.contains(&fault) {
            Pace::Time
        } else {
            Pace::Readings
        };
        if fault == TERMINAL_CLOSED {
            self.probe = None;
        } else {
            self.inject(fault);
        }
    }

    fn program(&self, of: LoopState) -> Box<dyn Program> {
        let plan = match of {
            LoopState::Control => Plan::control(self.config.clone()).expect("a plan"),
            LoopState::Disarmed | LoopState::Armed | LoopState::Chirp => {
                Plan::chirp(self.config.clone())
            }
        };
        plan.program().expect("a program")
    }

    /// Brings the loop into a state; runs until a current flows.
    fn enter(&mut self, state: LoopState) {
        if state == LoopState::Disarmed {
            return;
        }
        self.bench.request(Request::Arm);
        self.run(2);
        if state != LoopState::Armed {
            self.bench.request(Request::Start(self.program(state)));
            for _ in 0..TICKS {
                self.tick();
                if self.current_a().abs() > 0.02 {
                    return;
                }
            }
            panic!("no current flows: {:?}", self.bench.trips());
        }
    }

    /// Requests the next states up to a run, as an operator who has not noticed the fault.
    fn continue_to_run(&mut self, state: LoopState) {
        if state == LoopState::Disarmed {
            self.bench.request(Request::Arm);
        }
        if matches!(state, LoopState::Disarmed | LoopState::Armed)
            && self.bench.state() != State::Tripped
        {
            self.bench
                .request(Request::Start(self.program(LoopState::Chirp)));
        }
    }

    fn current_a(&self) -> f64 {
        f64::from_bits(self.current_a.load(Ordering::Relaxed))
    }

    /// Waits for the trip and checks its effect.
    fn assert_trips(&mut self, reason: &str) {
        for _ in 0..TICKS {
            self.tick();
            if self.bench.state() == State::Tripped {
                break;
            }
        }
        self.run(20);
        let trips = self.bench.trips();
        let [trip] = trips[..] else {
            panic!("one trip: {trips:?} {:?}", self.statistics.statistics())
        };
        let EventKind::Trip(why) = trip.kind else {
            unreachable!()
        };
        assert_eq!(
            why.reason(),
            reason,
            "{why}: {:?}",
            self.statistics.statistics()
        );
        assert!(
            self.bench
                .ticks()
                .iter()
                .all(|record| record.tick < trip.tick || record.command_a.to_bits() == 0)
        );
        assert!(
            self.current_a() == 0.0 && !self.bench.amplifier_is_on(),
            "{} A",
            self.current_a()
        );
        self.bench.assert_recording_complete(trip.tick, reason);
    }

    /// Removes the fault, clears the trip, and asserts that the next run has no trip.
    fn assert_next_run_has_no_trip(&mut self) {
        self.inject("probe.none");
        self.pace = Pace::Readings;
        self.run(50); // the first readings may be from before the end of the fault
        if self.bench.state() == State::Tripped {
            self.bench.request(Request::Clear);
            self.run(1);
        }
        self.assert_run_has_no_trip();
    }

    fn assert_run_has_no_trip(&mut self) {
        let trips = self.bench.trips().len();
        assert!(
            !self.bench.amplifier_is_on(),
            "the amplifier is off after clear"
        );
        self.enter(LoopState::Control);
        self.run(50);
        assert_eq!(
            (self.bench.state(), self.bench.trips().len()),
            (State::Running, trips),
            "{:?}",
            self.bench.trips()
        );
    }
}

/// The states in which a fault begins.
#[derive(Clone, Copy, Debug, PartialEq)]
enum LoopState {
    Disarmed,
    Armed,
    Chirp,
    Control,
}

const STATES: [LoopState; 4] = [
    LoopState::Disarmed,
    LoopState::Armed,
    LoopState::Chirp,
    LoopState::Control,
];

/// Permitted age of a reading in the tests of old readings. A suspended thread must not reach it.
const STALE_S: f64 = 3.0;
/// Permitted age in the other tests, so that a slow machine causes no trip.
const LONG_STALE_S: f64 = 10.0;
/// A delay longer than the permitted age of a reading.
const LATE_ANSWERS: &str = "probe.late=9s";
/// Not a fault of the probe but of its cable.
const TERMINAL_CLOSED: &str = "the terminal is closed";

/// Runs the test in each state, concurrently because it mostly waits.
fn in_each_state(stale_s: f64, test: impl Fn(&mut ProbeRig, LoopState) + Sync) {
    std::thread::scope(|scope| {
        for state in STATES {
            let test = &test;
            scope.spawn(move || {
                let mut rig = ProbeRig::new(stale_s);
                rig.enter(state);
                test(&mut rig, state);
            });
        }
    });
}

fn assert_trip_and_next_run(fault: &str, reason: &str) {
    let stale_s = match reason {
        "probe_stale" => STALE_S,
        _ => LONG_STALE_S,
    };
    in_each_state(stale_s, |rig, state| {
        rig.begin_fault(fault);
        if state == LoopState::Disarmed {
            rig.run(20);
            assert_eq!(rig.current_a(), 0.0);
        }
        rig.continue_to_run(state);
        rig.assert_trips(reason);
        rig.assert_next_run_has_no_trip();
    });
}

#[test]
fn silent_probe_causes_stale_trip() {
    assert_trip_and_next_run("probe.silence", "probe_stale");
}

#[test]
fn damaged_bytes_cause_stale_trip() {
    assert_trip_and_next_run("probe.corrupt", "probe_stale");
}

#[test]
fn late_answers_cause_stale_trip() {
    assert_trip_and_next_run(LATE_ANSWERS, "probe_stale");
}

#[test]
fn constant_value_under_changing_current_causes_stuck_trip() {
    assert_trip_and_next_run("probe.stuck", "probe_stuck");
}

#[test]
fn jump_beyond_the_soft_limit_causes_travel_trip() {
    assert_trip_and_next_run("probe.jump=1.4mm", "travel");
}

#[test]
fn target_out_of_range_causes_invalid_trip() {
    assert_trip_and_next_run("probe.out-of-range", "probe_invalid");
}

/// A restart truncates one line, whose rest may damage the next one.
const LOST_AT_RESTART: u64 = 2;

#[test]
fn probe_restart_causes_no_trip() {
    in_each_state(LONG_STALE_S, |rig, state| {
        // Readings on their way count as measured only, so that the bound holds on a slow machine.
        let read_before = rig.statistics.statistics().values;
        let measured_before = rig.measurements();
        rig.begin_fault("probe.reset");
        rig.run(50);
        let measured = rig.measurements() - measured_before;
        // After 50 more readings all lines of these measurements have been read.
        rig.run(50);
        let read = rig.statistics.statistics().values - read_before;
        assert!(
            read + LOST_AT_RESTART >= measured,
            "{read} of {measured} measurements were read"
        );
        assert_eq!(rig.bench.trips(), []);
        let damaged = rig.statistics.statistics().damaged_bytes;
        assert!(damaged > 0, "the line at the restart is truncated");
        rig.continue_to_run(state);
        rig.run(50);
        assert_eq!(
            (rig.bench.trips(), rig.bench.state()),
            (vec![], State::Running)
        );
    });
}

#[test]
fn closed_terminal_trips_and_the_probe_can_be_opened_again() {
    in_each_state(LONG_STALE_S, |rig, state| {
        rig.begin_fault(TERMINAL_CLOSED);
        rig.continue_to_run(state);
        rig.assert_trips("probe_invalid");
        let message = rig
            .statistics
            .statistics()
            .last_error
            .expect("an error")
            .to_string();
        assert!(
            message.contains("the serial port is gone") && message.contains("open the probe again"),
            "{message}"
        );
        let (config, stage, folder) = (
            rig.config.clone(),
            rig.stage.clone(),
            Arc::clone(&rig._folder),
        );
        ProbeRig::around(config, stage, rig.start, folder).assert_run_has_no_trip();
    });
}
