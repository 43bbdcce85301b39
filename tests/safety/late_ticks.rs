//! Late ticks: missed ticks are counted, flagged and skipped in the numbering, and never caught up.
use std::sync::{Arc, Mutex};
use std::task::Poll;
use std::time::Duration;

use bench_hal::{
    AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, Reading, Rig, Tick,
};
use bench_rig::simulated::SimulatedRig;
use bench_rt::clock::{Clock, Realtime, TickTiming};
use bench_rt::live_loop::run_to_end;
use bench_rt::program::{Decision, Program, ProgramInput};
use bench_rt::publisher::Publisher;
use bench_rt::record::{LoopMessage, TickRecord, flag};
use bench_rt::request::RequestSender;
use bench_rt::servo::{Request, Servo};
use bench_rt::servo_run::{Connections, Progress, ServoEnd, ServoRun};
use rtrb::RingBuffer;

use crate::safety::rig::{CurrentProgram, StillRig, interlocks, stage};

/// A clock with late ticks: (call, missed ticks).
struct LateClock {
    late: Vec<(u64, u32)>,
    calls: u64,
}

impl Clock for LateClock {
    fn wait(&mut self, number: u64, _outlet: &Publisher) -> TickTiming {
        let missed = self
            .late
            .iter()
            .find(|(call, _)| *call == self.calls)
            .map_or(0, |(_, missed)| *missed);
        self.calls += 1;
        let number = number + u64::from(missed);
        let scheduled_ns = number * 200_000;
        TickTiming {
            tick: Tick {
                number,
                scheduled_ns,
            },
            woke_ns: scheduled_ns + 1000,
            missed,
        }
    }
    fn now_ns(&self, tick: Tick) -> u64 {
        tick.scheduled_ns + 2000
    }
}

fn run(
    rig: impl Rig + 'static,
    program: Box<dyn Program>,
    clock: impl Clock,
    overruns_per_s: u32,
    tail: u64,
) -> (ServoEnd, Vec<TickRecord>) {
    let mut config = stage();
    config.interlock.overruns_per_s = overruns_per_s;
    let (publisher, mut records) = RingBuffer::new(1 << 14);
    let (mut requests, taken) = RequestSender::ring(16);
    let (retired, _retired) = RingBuffer::new(16);
    assert!(requests.send(Request::Arm).is_ok() && requests.send(Request::Start(program)).is_ok());
    let connections = Connections {
        requests: taken,
        retired,
        publisher: Publisher::new(publisher),
        progress: Arc::new(Progress::default()),
    };
    let run = ServoRun::new(interlocks(&config), connections).with_tail(tail);
    let mut servo = Servo::new(Box::new(rig), Box::new(run), config.servo.period_s());
    run_to_end(&mut servo, clock);
    let ended = servo.run().outcome();
    drop(servo);
    let messages = std::iter::from_fn(move || records.pop().ok());
    let ticks = messages.filter_map(|message| match message {
        LoopMessage::Tick(record) => Some(record),
        LoopMessage::Event(_) => None,
    });
    (ended, ticks.collect())
}

#[test]
fn missed_ticks_are_counted_flagged_and_skipped_in_the_numbering() {
    let clock = LateClock {
        late: vec![(10, 1), (11, 7), (30, 20)],
        calls: 0,
    };
    let (ended, records) = run(
        StillRig::default(),
        Box::new(CurrentProgram(|_| 0.1, 100)),
        clock,
        50,
        10,
    );
    assert!(ended.completed && ended.lost_records == 0);
    // 100 ticks of the run, and the tail of 10, which begins with the tick of completion.
    assert_eq!(records.len(), 110);
    let mut expected = 0;
    for (call, record) in records.iter().enumerate() {
        let missed = match call {
            10 => 1,
            11 => 7,
            30 => 20,
            _ => 0,
        };
        expected += u64::from(missed);
        assert_eq!(
            (record.tick, record.missed_ticks),
            (expected, missed),
            "{record:?}"
        );
        assert_eq!(record.flags & flag::OVERRUN != 0, missed > 0, "{record:?}");
        assert_eq!(
            (record.scheduled_ns, record.woke_ns - record.scheduled_ns),
            (record.tick * 200_000, 1000)
        );
        expected += 1;
    }
    assert_eq!(expected, 110 + 28);
}

/// A program that records the ticks of its calls.
struct RecordingProgram(Arc<Mutex<Vec<u64>>>, u64);

impl Program for RecordingProgram {
    fn decide(&mut self, input: &ProgramInput) -> Decision {
        let tick = input.tick;
        self.0.lock().expect("not poisoned").push(tick);
        Decision {
            requested_a: 0.1,
            active: true,
            ..Decision::default()
        }
    }
    fn ticks(&self) -> u64 {
        self.1
    }
}

#[test]
fn program_continues_after_missed_ticks_without_catching_up() {
    // Catching up would give more ticks than calls of the clock, or skip or repeat ticks of the program.
    let called = Arc::default();
    let clock = LateClock {
        late: vec![(10, 3), (20, 5)],
        calls: 0,
    };
    let (ended, records) = run(
        StillRig::default(),
        Box::new(RecordingProgram(Arc::clone(&called), 50)),
        clock,
        50,
        0,
    );
    assert!(ended.completed);
    assert_eq!(
        *called.lock().expect("not poisoned"),
        (0..50).collect::<Vec<u64>>()
    );
    let steps: Vec<u64> = records
        .windows(2)
        .map(|pair| pair[1].tick - pair[0].tick)
        .collect();
    assert!(steps.iter().all(|step| *step >= 1));
    assert_eq!(
        steps.iter().filter(|step| **step > 1).collect::<Vec<_>>(),
        [&4, &6]
    );
}

/// A rig whose probe blocks the loop once, for 20 ms.
struct BlockingRig(StillRig, u64);

impl CurrentAmplifier for BlockingRig {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        self.0.begin_enable()
    }
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        self.0.poll_enable()
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        self.0.command(current_a)
    }
    fn disable(&mut self) {
        self.0.disable();
    }
    fn status(&self) -> AmplifierStatus {
        self.0.status()
    }
}

impl DisplacementProbe for BlockingRig {
    fn latest(&mut self, now: Tick) -> Reading {
        if now.number >= self.1 {
            self.1 = u64::MAX;
            std::thread::sleep(Duration::from_millis(20));
        }
        self.0.latest(now)
    }
}

#[test]
fn real_time_ticks_are_served_or_counted_as_missed() {
    // 500 Hz for a second. The probe blocks for 20 ms in one tick, which is ten periods: at least nine ticks are missed.
    let clock = Realtime::new(0.002).awake_before_ticks(80e-6);
    let (ended, records) = run(
        BlockingRig(StillRig::default(), 100),
        Box::new(CurrentProgram(|_| 0.1, 500)),
        clock,
        u32::MAX,
        20,
    );
    assert!(ended.completed && ended.lost_records == 0);
    let missed: u64 = records.iter().map(|r| u64::from(r.missed_ticks)).sum();
    let last = records.last().expect("ticks").tick;
    assert_eq!(
        records.len() as u64 + missed,
        last + 1,
        "scheduled ticks are 0 to {last}"
    );
    assert_eq!(records.len(), 520);
    let most = records.iter().map(|r| r.missed_ticks).max().expect("ticks");
    assert!(most >= 9, "{most} missed at once");
    for pair in records.windows(2) {
        assert_eq!(
            pair[1].tick - pair[0].tick,
            1 + u64::from(pair[1].missed_ticks)
        );
        assert_eq!(pair[1].flags & flag::OVERRUN != 0, pair[1].missed_ticks > 0);
    }
    for record in &records {
        assert_eq!(record.scheduled_ns, record.tick * 2_000_000);
        assert!(
            record.woke_ns >= record.scheduled_ns,
            "a tick begins before its scheduled time: {record:?}"
        );
        // The served tick is always the latest one that is due, so it is less than a period late (plus rounding) on any machine.
        assert!(
            record.woke_ns < record.scheduled_ns + 2_000_000 + 10,
            "{record:?}"
        );
    }
}

/// A rig whose driver blocks the loop for 20 ms when it is enabled, against the rules.
struct SlowToEnable(StillRig);

impl CurrentAmplifier for SlowToEnable {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        std::thread::sleep(Duration::from_millis(20));
        self.0.begin_enable()
    }
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        self.0.poll_enable()
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        self.0.command(current_a)
    }
    fn disable(&mut self) {
        self.0.disable();
    }
    fn status(&self) -> AmplifierStatus {
        self.0.status()
    }
}

impl DisplacementProbe for SlowToEnable {
    fn latest(&mut self, now: Tick) -> Reading {
        self.0.latest(now)
    }
}

#[test]
fn ticks_missed_while_the_amplifier_is_enabled_are_counted() {
    // 500 Hz: 20 ms are ten periods, so that at least nine ticks are missed.
    let (ended, records) = run(
        SlowToEnable(StillRig::default()),
        Box::new(CurrentProgram(|_| 0.1, 50)),
        Realtime::new(0.002),
        u32::MAX,
        0,
    );
    assert!(ended.completed);
    let missed: u64 = records.iter().map(|r| u64::from(r.missed_ticks)).sum();
    assert!(missed >= 9, "{missed}");
    let last = records.last().expect("ticks").tick;
    assert_eq!(records.len() as u64 + missed, last + 1);
}

#[test]
fn too_many_missed_ticks_trip_in_real_time() {
    let clock = Realtime::new(0.002);
    let (ended, records) = run(
        BlockingRig(StillRig::default(), 100),
        Box::new(CurrentProgram(|_| 0.1, 5000)),
        clock,
        4,
        0,
    );
    let (trip, at) = ended
        .trip
        .expect("at least nine ticks are missed, four are allowed");
    assert_eq!((trip.reason(), ended.completed), ("overruns", false));
    let last = records.last().expect("ticks");
    assert_eq!(
        (
            last.tick,
            last.command_a.to_bits(),
            last.flags & flag::TRIPPED
        ),
        (at, 0, flag::TRIPPED)
    );
}

#[test]
fn simulated_amplifier_holds_the_delayed_command_during_missed_ticks() {
    for delay in 0..4 {
        let mut config = stage();
        config.servo.computing_delay_periods = delay;
        let now = |number| Tick {
            number,
            scheduled_ns: number * 200_000,
        };
        let current_a = |number: u64| 0.1 * (number % 7) as f64;
        let rigs = [(); 2].map(|()| SimulatedRig::new(&config).expect("a rig"));
        let [mut missing, mut serving] = rigs;
        for rig in [&mut missing, &mut serving] {
            bench_hal::blocking::enable(rig, std::thread::sleep).expect("enabled");
        }
        // `missing` misses four of ten ticks; `serving` repeats its last command in them, like a zero-order hold.
        for number in 0..1000u64 {
            let missed = (4..8).contains(&(number % 10));
            let held_a = current_a(if missed {
                number - number % 10 + 3
            } else {
                number
            });
            serving.latest(now(number));
            serving.command(held_a).expect("enabled");
            if !missed {
                missing.latest(now(number));
                missing.command(held_a).expect("enabled");
                let positions = [&missing, &serving].map(|rig| rig.true_position_m().to_bits());
                assert_eq!(positions[0], positions[1], "delay {delay}, tick {number}");
            }
        }
        assert!(
            serving.true_position_m() > 1e-5,
            "the stage moved: {}",
            serving.true_position_m()
        );
    }
}
