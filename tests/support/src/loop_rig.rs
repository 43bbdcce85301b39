//! A loop driven tick by tick, with a rig that records all calls of the amplifier.
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::task::Poll;

use bench_config::{Config, Source, load};
use bench_hal::{
    AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, FaultText, Reading, Rig,
    Tick, Validity,
};
use bench_recording::{Header, Recorder, Recording};
use bench_rig::calibration::Correction;
use bench_rt::arming::State;
use bench_rt::clock::{TickTiming, Virtual};
use bench_rt::interlock::Interlocks;
use bench_rt::program::{Decision, Program, ProgramInput};
use bench_rt::publisher::Publisher;
use bench_rt::record::{Event, EventKind, LoopMessage, TickRecord};
use bench_rt::request::RequestSender;
use bench_rt::servo::{Request, Servo};
use bench_rt::servo_run::{Connections, Progress, ServoEnd, ServoRun};
use bench_rt::supervision::{ArmLease, LeaseWatch, StopFlags};
use rtrb::{Consumer, RingBuffer};

use crate::faulty_rig::{Fault, FaultyRig};

/// The stage of the thesis.
pub fn stage() -> Config {
    load(&Source::default()).expect("the profile is valid")
}

/// A stage that moves by +-1 nm only, and an amplifier that returns every command unchanged.
#[derive(Debug, Default)]
pub struct StillRig {
    enabled: bool,
    sequence: u64,
}

impl CurrentAmplifier for StillRig {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        self.enabled = true;
        Ok(())
    }
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        Poll::Ready(Ok(()))
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        let disabled = DeviceError {
            what: "the amplifier is disabled",
            remedy: "arm the loop",
            code: 1,
        };
        if self.enabled {
            Ok(current_a)
        } else {
            Err(disabled)
        }
    }
    fn disable(&mut self) {
        self.enabled = false;
    }
    fn status(&self) -> AmplifierStatus {
        if self.enabled {
            AmplifierStatus::Enabled
        } else {
            AmplifierStatus::Disabled
        }
    }
}

impl DisplacementProbe for StillRig {
    fn latest(&mut self, _now: Tick) -> Reading {
        self.sequence += 1;
        let position_m = if self.sequence.is_multiple_of(2) {
            1e-9
        } else {
            -1e-9
        };
        Reading {
            position_m,
            sequence: self.sequence,
            age_ns: 0,
            validity: Validity::Valid,
        }
    }
}

/// A call of the amplifier.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AmplifierCall {
    Enable { refused: bool },
    Command { current_a: f64, refused: bool },
    Disable,
}

/// All calls of the amplifier, each with its tick.
pub type Log = Arc<Mutex<Vec<(u64, AmplifierCall)>>>;

/// A rig that records every call of its amplifier.
pub struct LoggedRig<R> {
    pub inner: R,
    pub log: Log,
    pub now: Arc<AtomicU64>,
}

impl<R> LoggedRig<R> {
    pub fn new(inner: R) -> Self {
        LoggedRig {
            inner,
            log: Log::default(),
            now: Arc::default(),
        }
    }

    fn note(&self, call: AmplifierCall) {
        self.log
            .lock()
            .expect("no test panics with it")
            .push((self.now.load(Ordering::Relaxed), call));
    }
}

impl<R: Rig> CurrentAmplifier for LoggedRig<R> {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        let answer = self.inner.begin_enable();
        self.note(AmplifierCall::Enable {
            refused: answer.is_err(),
        });
        answer
    }
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        self.inner.poll_enable()
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        let answer = self.inner.command(current_a);
        self.note(AmplifierCall::Command {
            current_a,
            refused: answer.is_err(),
        });
        answer
    }
    fn disable(&mut self) {
        self.inner.disable();
        self.note(AmplifierCall::Disable);
    }
    fn status(&self) -> AmplifierStatus {
        self.inner.status()
    }
    fn actual_current_a(&self) -> Option<f64> {
        self.inner.actual_current_a()
    }
    fn begin_reset(&mut self) -> Result<(), DeviceError> {
        self.inner.begin_reset()
    }
    fn poll_reset(&mut self) -> Poll<Result<(), DeviceError>> {
        self.inner.poll_reset()
    }
    fn explain(&self, code: u32) -> Option<FaultText> {
        self.inner.explain(code)
    }
}

impl<R: Rig> DisplacementProbe for LoggedRig<R> {
    fn latest(&mut self, now: Tick) -> Reading {
        self.inner.latest(now)
    }
}

/// A program whose command is a function of its tick; the second field is its number of ticks.
pub struct CurrentProgram<F>(pub F, pub u64);

impl<F: FnMut(u64) -> f64 + Send> Program for CurrentProgram<F> {
    fn decide(&mut self, input: &ProgramInput) -> Decision {
        Decision {
            requested_a: (self.0)(input.tick),
            active: true,
            ..Decision::default()
        }
    }
    fn ticks(&self) -> u64 {
        self.1
    }
}

/// A program without an end.
pub fn endless(current_a: impl FnMut(u64) -> f64 + Send + 'static) -> Box<dyn Program> {
    Box::new(CurrentProgram(current_a, u64::MAX))
}

/// The interlocks of a configuration.
pub fn interlocks(config: &Config) -> Interlocks {
    Interlocks::new(
        &config.interlock,
        &config.amplifier,
        &config.motor,
        &config.servo,
    )
}

/// The loop, its rings, and everything it has published.
pub struct Bench {
    /// Rig and run before the first tick.
    run: Option<(Box<dyn Rig>, ServoRun)>,
    servo: Option<Servo>,
    requests: RequestSender,
    published: Consumer<LoopMessage>,
    retired: Consumer<Box<dyn Program>>,
    log: Log,
    now: Arc<AtomicU64>,
    clock: Virtual,
    next: u64,
    /// All messages of the loop, in their order.
    pub all: Vec<LoopMessage>,
    /// Number of programs that the loop has returned.
    pub returned_programs: usize,
}

impl Bench {
    pub fn around(config: &Config, rig: impl Rig + 'static) -> Bench {
        let logged = LoggedRig::new(rig);
        let (log, now) = (Arc::clone(&logged.log), Arc::clone(&logged.now));
        let (publisher, published) = RingBuffer::new(256);
        let (requests, taken) = RequestSender::ring(16);
        let (hand_back, retired) = RingBuffer::new(16);
        let connections = Connections {
            requests: taken,
            retired: hand_back,
            publisher: Publisher::new(publisher),
            progress: Arc::new(Progress::default()),
        };
        Bench {
            run: Some((
                Box::new(logged),
                ServoRun::new(interlocks(config), connections),
            )),
            servo: None,
            requests,
            published,
            retired,
            log,
            now,
            clock: Virtual {
                period_s: config.servo.period_s(),
            },
            next: 0,
            all: Vec::new(),
            returned_programs: 0,
        }
    }

    /// The same loop with a changed run. Only before the first tick.
    fn with_run(self, change: impl FnOnce(ServoRun) -> ServoRun) -> Bench {
        let (rig, run) = self.run.expect("before the first tick");
        Bench {
            run: Some((rig, change(run))),
            ..self
        }
    }

    /// The same loop with a correction between its program and the rig.
    pub fn with_correction(self, correction: Correction) -> Bench {
        self.with_run(|run| run.with_correction(Some(correction)))
    }

    /// The same loop with ramps to zero current at the end of a run.
    pub fn with_ramps(self, ramp_ticks: u64) -> Bench {
        self.with_run(|run| run.with_ramps(ramp_ticks))
    }

    /// The same loop with `ticks` healthy ticks before the amplifier is enabled.
    pub fn with_healthy_ticks(self, ticks: u64) -> Bench {
        self.with_run(|run| run.with_healthy_ticks(ticks))
    }

    /// The same loop with flags that stop a run.
    pub fn with_stop_flags(self, flags: &StopFlags) -> Bench {
        self.with_run(|run| run.with_stop_flags(flags.clone()))
    }

    /// The same loop with an arm lease that expires after `limit_ticks`.
    pub fn with_lease(self, lease: &Arc<ArmLease>, limit_ticks: u64) -> Bench {
        let watch = LeaseWatch::new(Arc::clone(lease), limit_ticks);
        self.with_run(|run| run.with_lease(Some(watch)))
    }

    /// A stage at rest, disarmed.
    pub fn still(config: &Config, faults: &[(Range<u64>, Fault)]) -> Bench {
        Bench::around(config, FaultyRig::new(StillRig::default(), faults))
    }

    /// A stage at rest, with a program that runs from tick 0.
    pub fn running(
        config: &Config,
        faults: &[(Range<u64>, Fault)],
        program: Box<dyn Program>,
    ) -> Bench {
        let mut bench = Bench::still(config, faults);
        bench.request(Request::Arm);
        bench.request(Request::Start(program));
        bench
    }

    /// Adds a request, which the loop processes in its next tick.
    pub fn request(&mut self, request: Request) {
        assert!(
            self.requests.send(request).is_ok(),
            "the ring of requests is full"
        );
    }

    pub fn tick(&mut self) -> TickRecord {
        self.late_tick(0)
    }

    /// A tick after `missed` missed ticks.
    pub fn late_tick(&mut self, missed: u32) -> TickRecord {
        let number = self.next + u64::from(missed);
        let scheduled_ns = (number as f64 * self.clock.period_s * 1e9).round() as u64;
        let tick = Tick {
            number,
            scheduled_ns,
        };
        self.now.store(number, Ordering::Relaxed);
        let period_s = self.clock.period_s;
        if let Some((rig, run)) = self.run.take() {
            self.servo = Some(Servo::new(rig, Box::new(run), period_s));
        }
        let servo = self.servo.as_mut().expect("made before the first tick");
        servo.tick(
            &TickTiming {
                tick,
                woke_ns: scheduled_ns,
                missed,
            },
            &self.clock,
        );
        self.next = number + 1;
        while let Ok(published) = self.published.pop() {
            self.all.push(published);
        }
        while self.retired.pop().is_ok() {
            self.returned_programs += 1;
        }
        *self
            .ticks()
            .last()
            .expect("every tick publishes its record")
    }

    pub fn run(&mut self, ticks: u64) {
        for _ in 0..ticks {
            self.tick();
        }
    }

    pub fn ticks(&self) -> Records<'_> {
        Records(&self.all)
    }

    pub fn events(&self) -> Vec<Event> {
        let event = |p: &LoopMessage| {
            if let LoopMessage::Event(event) = p {
                Some(*event)
            } else {
                None
            }
        };
        self.all.iter().filter_map(event).collect()
    }

    /// State after the last tick, from the events.
    pub fn state(&self) -> State {
        let to = |event: &Event| {
            if let EventKind::State { to, .. } = event.kind {
                Some(to)
            } else {
                None
            }
        };
        self.events().iter().rev().find_map(to).unwrap_or_default()
    }

    pub fn trips(&self) -> Vec<Event> {
        self.events()
            .into_iter()
            .filter(|event| matches!(event.kind, EventKind::Trip(_)))
            .collect()
    }

    /// All calls of the amplifier so far.
    pub fn amplifier_calls(&self) -> Vec<(u64, AmplifierCall)> {
        self.log.lock().expect("no test panics with it").clone()
    }

    /// Whether the amplifier is on after its last call.
    pub fn amplifier_is_on(&self) -> bool {
        let calls = self.amplifier_calls();
        let last = calls.iter().rev().find(|(_, call)| {
            matches!(call, AmplifierCall::Enable { .. } | AmplifierCall::Disable)
        });
        matches!(last, Some((_, AmplifierCall::Enable { refused: false })))
    }

    /// All messages so far, written as a recording and read back, with its folder.
    pub fn recorded(&self) -> (tempfile::TempDir, Recording) {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("loop.mcap");
        let header = Header {
            period_s: self.clock.period_s,
            started_ns: 0,
            ..Header::default()
        };
        let mut recorder = Recorder::create(&path, &header).expect("a new file");
        self.all
            .iter()
            .for_each(|published| recorder.record(published).expect("a good disk"));
        recorder.finish(&[]).expect("a good disk");
        (folder, Recording::open(&path).expect("a recording"))
    }

    /// Asserts that every tick is recorded or counted as missed, and that the trip is recorded with its reason.
    pub fn assert_recording_complete(&self, at: u64, reason: &str) {
        let (_folder, recording) = self.recorded();
        let last = self.ticks().last().expect("ticks").tick;
        assert!(!recording.truncated());
        assert_eq!(
            (
                recording.first_tick(),
                recording.last_tick(),
                recording.lost_records()
            ),
            (0, last, 0)
        );
        assert_eq!(
            recording.tick_count() + recording.overruns(),
            last + 1,
            "every tick is recorded or counted as missed"
        );
        let is_trip = |event: &Event| {
            event.tick == at
                && matches!(event.kind, EventKind::Trip(trip) if trip.reason() == reason)
        };
        assert!(
            recording.events().iter().any(is_trip),
            "the trip is in the recording: {:?}",
            recording.events()
        );
    }

    pub fn outcome(&self) -> ServoEnd {
        self.servo
            .as_ref()
            .expect("after the first tick")
            .run()
            .outcome()
    }
}

/// The tick records among the messages of the loop.
pub struct Records<'a>(&'a [LoopMessage]);

impl<'a> Records<'a> {
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &'a TickRecord> + use<'a> {
        self.0.iter().filter_map(|p| {
            if let LoopMessage::Tick(record) = p {
                Some(record)
            } else {
                None
            }
        })
    }

    pub fn last(&self) -> Option<&'a TickRecord> {
        self.iter().next_back()
    }

    pub fn at(&self, tick: u64) -> TickRecord {
        *self
            .iter()
            .find(|record| record.tick == tick)
            .expect("a record of the tick")
    }
}
