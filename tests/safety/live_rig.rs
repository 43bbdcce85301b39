//! A loop that lives as long as its rig and serves several runs.
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::task::Poll;
use std::time::Duration;

use bench_config::Config;
use bench_experiment::{LiveRig, Plan, Run, Runner, Setup, replay};
use bench_hal::{
    AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, Reading, Rig, Tick, Validity,
};
use bench_recording::Recording;
use bench_rig::simulated::SimulatedRig;
use bench_rt::device_defect::DeviceDefect;
use bench_rt::live_loop::{LiveLoop, LoopPanicked};
use bench_rt::program::Program;
use bench_rt::publisher::Publisher;
use bench_rt::record::{EventKind, LoopMessage, Refusal};
use bench_rt::request::{Request, RequestSender};
use bench_rt::servo_run::{Connections, Progress, ServoEnd, ServoRun};
use bench_rt::thread::Pace;
use rtrb::{Consumer, RingBuffer};

use crate::safety::faulty_rig::{Fault, FaultyRig};
use crate::safety::rig::{
    AmplifierCall, CurrentProgram, Log, LoggedRig, StillRig, endless, interlocks, stage,
};

/// A rig that records the ticks at which it is read.
struct CountedRig<R> {
    inner: R,
    ticks: Arc<Mutex<Vec<Tick>>>,
    open: Arc<AtomicU64>,
}

impl<R: Rig> CurrentAmplifier for CountedRig<R> {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        self.inner.begin_enable()
    }
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        self.inner.poll_enable()
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        self.inner.command(current_a)
    }
    fn disable(&mut self) {
        self.inner.disable();
    }
    fn status(&self) -> AmplifierStatus {
        self.inner.status()
    }
}

impl<R: Rig> DisplacementProbe for CountedRig<R> {
    fn latest(&mut self, now: Tick) -> Reading {
        self.ticks.lock().expect("no test panics with it").push(now);
        self.inner.latest(now)
    }
}

impl<R> Drop for CountedRig<R> {
    fn drop(&mut self) {
        self.open.fetch_sub(1, Ordering::SeqCst);
    }
}

fn calls_of(log: &Log) -> Vec<AmplifierCall> {
    let log = log.lock().expect("no test panics with it");
    log.iter().map(|(_, call)| *call).collect()
}

/// A run with its requests, and the end of its messages.
fn servo_run(requests: Vec<Request>) -> (Box<ServoRun>, Consumer<LoopMessage>) {
    let (mut sender, taken) = RequestSender::ring(16);
    for request in requests {
        assert!(sender.send(request).is_ok());
    }
    let (publisher, messages) = RingBuffer::new(1 << 14);
    let connections = Connections {
        requests: taken,
        retired: RingBuffer::new(16).0,
        publisher: Publisher::new(publisher),
        progress: Arc::new(Progress::default()),
    };
    let run = ServoRun::new(interlocks(&stage()), connections).with_tail(5);
    (Box::new(run), messages)
}

fn live_loop(rig: impl Rig + 'static, pace: Pace) -> LiveLoop {
    let (idle, _) = servo_run(Vec::new());
    LiveLoop::open(Box::new(rig), idle, &stage().servo, pace).expect("a thread")
}

fn start(program: Box<dyn Program>) -> Vec<Request> {
    vec![Request::Arm, Request::Start(program)]
}

fn wait_for_end(live: &mut LiveLoop) -> Result<Box<ServoRun>, LoopPanicked> {
    for _ in 0..60_000 {
        if let Poll::Ready(ended) = live.poll_end() {
            return ended;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    panic!("the run goes on");
}

/// Serves a run; returns how it ended, and the refusals of its requests.
fn serve(live: &mut LiveLoop, requests: Vec<Request>) -> (ServoEnd, Vec<Option<Refusal>>) {
    let (run, mut messages) = servo_run(requests);
    assert!(live.begin(run).is_ok());
    let ended = wait_for_end(live).expect("no panic");
    let messages = std::iter::from_fn(|| messages.pop().ok());
    let refusals = messages.filter_map(|message| match message {
        LoopMessage::Event(event) => match event.kind {
            EventKind::Request(request) => Some(request.refusal),
            _ => None,
        },
        LoopMessage::Tick(_) => None,
    });
    (ended.outcome(), refusals.collect())
}

fn control(controller: &str) -> Plan {
    let mut config = stage();
    config.control.controller = controller.into();
    config.control.duration_s = 1.0;
    Plan::control(config).expect("a plan")
}

fn finished(run: Run) -> Recording {
    assert!(run.end.servo.completed, "{:?}", run.end.servo);
    let path = run.path.clone();
    run.finish("{}").expect("a good disk");
    Recording::open(&path).expect("a recording")
}

#[test]
fn each_run_has_its_own_ticks_and_recording_while_the_rig_stays_open() {
    let config = stage();
    let (ticks, open) = (Arc::default(), Arc::new(AtomicU64::new(1)));
    let rig = LoggedRig::new(CountedRig {
        inner: SimulatedRig::new(&config).expect("a rig"),
        ticks: Arc::clone(&ticks),
        open: Arc::clone(&open),
    });
    let log = Arc::clone(&rig.log);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mut live = LiveRig::open(Box::new(rig), &config, Pace::Virtual).expect("a thread");
    let mut recorded_ticks = 0;
    for controller in ["slow", "fast", "slow"] {
        let plan = control(controller);
        let run = live
            .run(&plan, folder.path(), &mut |_, _| {})
            .expect("a run");
        let recording = finished(run);
        assert_eq!(calls_of(&log).last(), Some(&AmplifierCall::Disable));
        assert_eq!(recording.first_tick(), 0);
        assert_eq!(recording.tick_count(), recording.last_tick() + 1, "no gap");
        recorded_ticks += recording.tick_count();
        let replayed = replay(&recording).expect("it can be replayed");
        assert_eq!((replayed.different, replayed.first), (0, None));
    }
    assert_eq!(open.load(Ordering::SeqCst), 1, "the rig is open");
    drop(live);
    assert_eq!(open.load(Ordering::SeqCst), 0, "the rig is closed");
    let ticks: Vec<Tick> = ticks.lock().expect("no test panics with it").clone();
    assert_eq!(ticks.len() as u64, recorded_ticks);
    for (expected, tick) in ticks.iter().enumerate() {
        assert_eq!(tick.number, expected as u64, "the rig counts on");
        assert_eq!(tick.scheduled_ns, expected as u64 * 200_000);
    }
}

#[test]
fn a_trip_outlasts_its_run_until_it_is_cleared() {
    let rig = FaultyRig::new(
        StillRig::default(),
        &[(20..21, Fault::Validity(Validity::Faulty))],
    );
    let mut live = live_loop(rig, Pace::Virtual);
    let (tripped, _) = serve(&mut live, start(endless(|_| 0.1)));
    assert!(tripped.trip.is_some() && !tripped.completed);
    let program = || Box::new(CurrentProgram(|_| 0.1, 50));
    let (refused, refusals) = serve(&mut live, start(program()));
    assert!(!refused.completed);
    assert_eq!(refusals, [Some(Refusal::Tripped); 2]);
    let (_, accepted) = serve(&mut live, vec![Request::Clear]);
    assert_eq!(accepted, [None]);
    let (ended, accepted) = serve(&mut live, start(program()));
    assert!(ended.completed && ended.trip.is_none());
    assert_eq!(accepted, [None, None]);
}

#[test]
fn panic_in_a_run_disables_the_amplifier_and_is_reported_to_later_runs() {
    let rig = LoggedRig::new(StillRig::default());
    let log = Arc::clone(&rig.log);
    let mut live = live_loop(rig, Pace::Virtual);
    let panicking = endless(|tick| {
        assert!(tick < 10, "panic of the test program");
        0.1
    });
    assert!(live.begin(servo_run(start(panicking)).0).is_ok());
    assert_eq!(wait_for_end(&mut live).err(), Some(LoopPanicked));
    assert_eq!(calls_of(&log).last(), Some(&AmplifierCall::Disable));
    let later = live.begin(servo_run(start(endless(|_| 0.1))).0);
    assert!(later.is_err() || wait_for_end(&mut live).err() == Some(LoopPanicked));
}

#[test]
fn a_second_run_is_refused_while_one_goes_on() {
    let mut live = live_loop(StillRig::default(), Pace::Virtual);
    let (run, messages) = servo_run(start(endless(|_| 0.1)));
    assert!(live.begin(run).is_ok());
    assert!(live.begin(servo_run(Vec::new()).0).is_err());
    drop(messages); // the loop goes on without a recorder
}

#[test]
fn between_runs_in_real_time_the_probe_is_read_and_no_current_is_commanded() {
    let (ticks, open) = (Arc::default(), Arc::new(AtomicU64::new(1)));
    let rig = LoggedRig::new(CountedRig {
        inner: StillRig::default(),
        ticks: Arc::clone(&ticks),
        open: Arc::clone(&open),
    });
    let log = Arc::clone(&rig.log);
    let mut live = live_loop(rig, Pace::Realtime);
    let program = Box::new(CurrentProgram(|_| 0.1, 50));
    let (ended, _) = serve(&mut live, start(program));
    assert!(ended.completed || ended.trip.is_some(), "{ended:?}");
    let calls = calls_of(&log).len();
    let count = || ticks.lock().expect("no test panics with it").len();
    let before = count();
    let grows = (0..60_000).any(|_| {
        std::thread::sleep(Duration::from_millis(1));
        count() >= before + 20
    });
    assert!(grows, "the loop goes on between runs");
    drop(live);
    assert_eq!(open.load(Ordering::SeqCst), 0, "the rig is closed");
    let later = calls_of(&log).split_off(calls);
    let is_disable = |call: &AmplifierCall| *call == AmplifierCall::Disable;
    assert!(later.iter().all(is_disable), "{later:?}");
}

/// Number of the first measurement of the probe in a recording: a rig that was opened for the run begins with 1.
fn first_measurement(recording: &Recording) -> u64 {
    let mut ticks = recording.ticks().expect("ticks");
    let first = ticks.next().expect("a tick").expect("a good tick");
    first.probe_sequence
}

#[test]
fn runner_keeps_the_rig_open_while_its_configuration_stays_the_same() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let runner = Runner::new(Setup::simulated(folder.path().into()));
    let sequence_of = |config: &dyn Fn(&mut Config)| {
        let mut plan = control("slow");
        config(&mut plan.config);
        let plan = Plan::control(plan.config).expect("a plan");
        first_measurement(&finished(runner.run(&plan, "control").expect("a run")))
    };
    assert_eq!(sequence_of(&|_| {}), 1);
    assert!(sequence_of(&|config| config.control.duration_s = 0.5) > 5000);
    assert_eq!(
        sequence_of(&|config| config.sim.seed += 1),
        1,
        "another rig"
    );
}

#[test]
fn runner_opens_the_rig_again_after_a_trip() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let runner = Runner::new(Setup::simulated(folder.path().into()));
    let mut tripping = control("slow");
    tripping.config.interlock.soft_limit_m = 1e-9;
    let tripped = runner.run(&tripping, "control").expect("a run");
    assert!(tripped.end.servo.trip.is_some(), "{:?}", tripped.end.servo);
    let again = runner.run(&tripping, "control").expect("a run");
    assert!(
        again.end.servo.trip.is_some(),
        "not refused: {:?}",
        again.end.servo
    );
}

#[test]
fn names_the_device_that_fails_between_two_runs() {
    for (fault, defect) in [
        (Fault::AmplifierFault(7), DeviceDefect::Amplifier),
        (Fault::Validity(Validity::Faulty), DeviceDefect::Probe),
        (Fault::Age(u64::MAX), DeviceDefect::Probe),
    ] {
        let rig = FaultyRig::new(StillRig::default(), &[(10..u64::MAX, fault)]);
        let live = LiveRig::open(Box::new(rig), &stage(), Pace::Realtime).expect("a thread");
        assert_eq!(wait_for_defect(&live), Some(defect), "{fault:?}");
    }
}

fn wait_for_defect(live: &LiveRig) -> Option<DeviceDefect> {
    for _ in 0..60_000 {
        if let Some(defect) = live.defect() {
            return Some(defect);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    None
}
