//! The serial driver with the emulated probe and its stage over a pseudo terminal, in real time, at about 200 Hz. While
//! readings arrive, each one starts a tick, so that a loaded machine slows the test down and does not fail it. The tests check
//! which interlock trips, not when.
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use bench::config::{Config, Source, load};
use bench::experiment::Plan;
use bench::rig::devices;
use bench::rig::emulator::{EmulatedFault, FaultRequest, ProbeEndpoint, ProbeServer, Stage};
use bench::rt::arming::State;
use bench::rt::program::Program;
use bench::rt::record::EventKind;
use bench::rt::servo::Request;
use bench_hal::serial::StatisticsHandle;
use bench_hal::{AmplifierStatus, CurrentAmplifier, DeviceError, Devices};

use crate::rig::Bench;

const PERIOD: Duration = Duration::from_millis(5);
/// Number of ticks within which a fault must trip and a current must flow: several times the longest time in the settings below.
const TICKS: u64 = 2000;
/// A test that waits longer than this has failed.
const PATIENCE: Duration = Duration::from_secs(120);

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
    // A test of one interlock must not reach the other one.
    let stuck_s = if stale_s < NEVER_STALE_S {
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
struct Straight {
    stage: Stage,
    start: Instant,
    given_a: Arc<AtomicU64>,
    is_on: bool,
}

impl Straight {
    fn give(&mut self, current_a: f64) {
        self.stage
            .command(self.start.elapsed().as_nanos() as u64, current_a);
        self.given_a.store(current_a.to_bits(), Ordering::Relaxed);
    }
}

impl CurrentAmplifier for Straight {
    fn enable(&mut self) -> Result<(), DeviceError> {
        self.is_on = true;
        Ok(())
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        assert!(
            self.is_on,
            "the loop commands an amplifier that it has switched off"
        );
        self.give(current_a);
        Ok(current_a)
    }
    fn disable(&mut self) {
        self.is_on = false;
        self.give(0.0);
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
struct Table {
    bench: Bench,
    watch: StatisticsHandle,
    probe: Option<ProbeServer>,
    stage: Stage,
    start: Instant,
    pace: Pace,
    published: u64,
    given_a: Arc<AtomicU64>,
    config: Config,
    _folder: Arc<tempfile::TempDir>,
}

impl Table {
    fn new(stale_s: f64) -> Table {
        let folder = Arc::new(tempfile::tempdir().expect("a temporary folder"));
        let (config, start) = (config(folder.path(), stale_s), Instant::now());
        let stage = Stage::new(&config).expect("a stage");
        Table::around(config, stage, start, folder)
    }

    fn around(
        config: Config,
        stage: Stage,
        start: Instant,
        folder: Arc<tempfile::TempDir>,
    ) -> Table {
        let end = ProbeEndpoint::Terminal(Some(folder.path().join("probe")));
        let now_ns = move || start.elapsed().as_nanos() as u64;
        let acting = ProbeServer::start(&config, &end, None, stage.clone(), now_ns)
            .expect("a pseudo terminal");
        let given_a = Arc::<AtomicU64>::default();
        let amplifier = Straight {
            stage: stage.clone(),
            start,
            given_a: Arc::clone(&given_a),
            is_on: false,
        };
        let probe =
            devices::probe::open(&config.probe, config.servo.priority).expect("the emulated probe");
        let watch = probe.statistics_handle();
        let bench = Bench::around(&config, Devices { amplifier, probe });
        let (probe, pace, published, _folder) = (Some(acting), Pace::Readings, 0, folder);
        let mut table = Table {
            bench,
            watch,
            probe,
            stage,
            start,
            pace,
            published,
            given_a,
            config,
            _folder,
        };
        table.run(10);
        table
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
        while self.watch.statistics().published == self.published {
            assert!(
                begun.elapsed() < PATIENCE,
                "no readings: {:?}",
                self.watch.statistics()
            );
            std::thread::sleep(Duration::from_millis(1));
        }
        self.published = self.watch.statistics().published;
    }

    fn run(&mut self, ticks: u64) {
        (0..ticks).for_each(|_| self.tick());
    }

    fn ask(&self, word: &str) {
        let request: FaultRequest = word.parse().expect("a fault");
        let EmulatedFault::Probe(fault) = request.fault else {
            panic!("{word} is not a fault of the probe")
        };
        let probe = self.probe.as_ref().expect("the probe is connected");
        probe.inject(fault);
    }

    /// The fault begins. The pace depends on whether readings still arrive.
    fn begin(&mut self, word: &str) {
        let silent = ["probe.silence", "probe.corrupt", LATE, HANG_UP];
        self.pace = if silent.contains(&word) {
            Pace::Time
        } else {
            Pace::Readings
        };
        if word == HANG_UP {
            self.probe = None;
        } else {
            self.ask(word);
        }
    }

    fn program(&self, of: StateOf) -> Box<dyn Program> {
        let plan = match of {
            StateOf::Control => Plan::control(self.config.clone()).expect("a plan"),
            _ => Plan::chirp(self.config.clone()),
        };
        plan.program().expect("a program")
    }

    /// Brings the loop into a state; runs until a current flows.
    fn enter(&mut self, state: StateOf) {
        if state == StateOf::Disarmed {
            return;
        }
        self.bench.order(Request::Arm);
        self.run(2);
        if state != StateOf::Armed {
            self.bench.order(Request::Start(self.program(state)));
            for _ in 0..TICKS {
                self.tick();
                if self.given_a().abs() > 0.02 {
                    return;
                }
            }
            panic!("no current flows: {:?}", self.bench.trips());
        }
    }

    /// An operator who has not noticed the fault goes on to the next state, in which current would flow.
    fn go_on(&mut self, state: StateOf) {
        if state == StateOf::Disarmed {
            self.bench.order(Request::Arm);
        }
        if matches!(state, StateOf::Disarmed | StateOf::Armed)
            && self.bench.state() != State::Tripped
        {
            self.bench
                .order(Request::Start(self.program(StateOf::Chirp)));
        }
    }

    fn given_a(&self) -> f64 {
        f64::from_bits(self.given_a.load(Ordering::Relaxed))
    }

    /// Waits for the trip, and proves what it promises.
    fn trips(&mut self, reason: &str) {
        for _ in 0..TICKS {
            self.tick();
            if self.bench.state() == State::Tripped {
                break;
            }
        }
        self.run(20);
        let trips = self.bench.trips();
        let [trip] = trips[..] else {
            panic!("one trip: {trips:?} {:?}", self.watch.statistics())
        };
        let EventKind::Trip(why) = trip.kind else {
            unreachable!()
        };
        assert_eq!(why.reason(), reason, "{why}: {:?}", self.watch.statistics());
        assert!(
            self.bench
                .ticks()
                .iter()
                .all(|record| record.tick < trip.tick || record.command_a.to_bits() == 0)
        );
        assert!(
            self.given_a() == 0.0 && !self.bench.is_on(),
            "{} A",
            self.given_a()
        );
        self.bench
            .prove_that_the_recording_is_complete(trip.tick, reason);
    }

    /// The cause is removed, the operator clears the trip, and the next run continues without a trip.
    fn next_run_is_clean(&mut self) {
        self.ask("probe.none");
        self.pace = Pace::Readings;
        self.run(50); // of these the first may be of the time before
        if self.bench.state() == State::Tripped {
            self.bench.order(Request::Clear);
            self.run(1);
        }
        self.runs_cleanly();
    }

    fn runs_cleanly(&mut self) {
        let trips = self.bench.trips().len();
        assert!(!self.bench.is_on(), "cleared is not armed");
        self.enter(StateOf::Control);
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
enum StateOf {
    Disarmed,
    Armed,
    Chirp,
    Control,
}

const STATES: [StateOf; 4] = [
    StateOf::Disarmed,
    StateOf::Armed,
    StateOf::Chirp,
    StateOf::Control,
];

/// Permitted age of a reading in the tests of old readings. A suspended thread must not reach it.
const STALE_S: f64 = 3.0;
/// Permitted age in the other tests, so that a slow machine causes no trip.
const NEVER_STALE_S: f64 = 10.0;
/// A delay longer than the permitted age of a reading.
const LATE: &str = "probe.late=9s";
/// Not a fault of the probe: its cable.
const HANG_UP: &str = "the terminal is closed";

/// Runs the test in each state, concurrently because it mostly waits.
fn in_each_state(stale_s: f64, test: impl Fn(&mut Table, StateOf) + Sync) {
    std::thread::scope(|scope| {
        for state in STATES {
            let test = &test;
            scope.spawn(move || {
                let mut table = Table::new(stale_s);
                table.enter(state);
                test(&mut table, state);
            });
        }
    });
}

fn trips_and_runs_again(word: &str, reason: &str) {
    let stale_s = match reason {
        "probe_stale" => STALE_S,
        _ => NEVER_STALE_S,
    };
    in_each_state(stale_s, |table, state| {
        table.begin(word);
        if state == StateOf::Disarmed {
            table.run(20);
            assert_eq!(table.given_a(), 0.0);
        }
        table.go_on(state);
        table.trips(reason);
        table.next_run_is_clean();
    });
}

#[test]
fn silent_probe_causes_stale_trip() {
    trips_and_runs_again("probe.silence", "probe_stale");
}

#[test]
fn damaged_bytes_cause_stale_trip() {
    trips_and_runs_again("probe.corrupt", "probe_stale");
}

#[test]
fn late_answers_cause_stale_trip() {
    trips_and_runs_again(LATE, "probe_stale");
}

#[test]
fn constant_value_under_changing_current_causes_stuck_trip() {
    trips_and_runs_again("probe.stuck", "probe_stuck");
}

#[test]
fn jump_beyond_the_soft_limit_causes_travel_trip() {
    trips_and_runs_again("probe.jump=1.4mm", "travel");
}

#[test]
fn target_out_of_range_causes_invalid_trip() {
    trips_and_runs_again("probe.out-of-range", "probe_invalid");
}

#[test]
fn probe_restart_causes_no_trip() {
    in_each_state(NEVER_STALE_S, |table, state| {
        table.begin("probe.reset");
        table.run(50);
        assert_eq!(table.bench.trips(), []);
        let damaged = table.watch.statistics().damaged_bytes;
        assert!(damaged > 0, "the line that it was in is cut off");
        table.go_on(state);
        table.run(50);
        assert_eq!(
            (table.bench.trips(), table.bench.state()),
            (vec![], State::Running)
        );
    });
}

#[test]
fn closed_terminal_trips_and_the_probe_can_be_opened_again() {
    in_each_state(NEVER_STALE_S, |table, state| {
        table.begin(HANG_UP);
        table.go_on(state);
        table.trips("probe_invalid");
        let said = table
            .watch
            .statistics()
            .last_error
            .expect("an error")
            .to_string();
        assert!(
            said.contains("the serial port is gone") && said.contains("open the probe again"),
            "{said}"
        );
        let (config, stage, folder) = (
            table.config.clone(),
            table.stage.clone(),
            Arc::clone(&table._folder),
        );
        Table::around(config, stage, table.start, folder).runs_cleanly();
    });
}
