//! The memory of the process is locked during a run, and only then. This is the only test of its process, because the lock is that of
//! the whole process.

use std::sync::Arc;
use std::time::{Duration, Instant};

use bench_config::{Config, Source, load};
use bench_rig::simulated::SimulatedRig;
use bench_rt::interlock::Interlocks;
use bench_rt::live_loop::LiveLoop;
use bench_rt::publisher::Publisher;
use bench_rt::request::RequestSender;
use bench_rt::servo_run::{Connections, Progress, ServoRun};
use bench_rt::thread::Pace;
use rtrb::RingBuffer;

/// A test that waits longer than this has failed. It is not a requirement.
const TIME_LIMIT: Duration = Duration::from_secs(60);
/// One second: the test looks at the locked memory at least once in it, also on a busy machine.
const RUN_TICKS: u64 = 5000;

/// `VmLck` of this process in kilobytes.
fn locked_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let line = status.lines().find_map(|line| line.strip_prefix("VmLck:"));
    let value = line.and_then(|line| line.trim().strip_suffix(" kB"));
    value.expect("a size").trim().parse().expect("a number")
}

/// A run without requests, which ends after `ticks`.
fn disarmed_run(config: &Config, ticks: u64) -> Box<ServoRun> {
    let connections = Connections {
        requests: RequestSender::ring(4).1,
        retired: RingBuffer::new(4).0,
        publisher: Publisher::new(RingBuffer::new(1 << 10).0),
        progress: Arc::new(Progress::default()),
    };
    let interlocks = Interlocks::new(
        &config.interlock,
        &config.amplifier,
        &config.motor,
        &config.servo,
    );
    Box::new(ServoRun::new(interlocks, connections).with_tail(ticks))
}

/// Waits for the end of the run; returns the largest size of the locked memory until then.
fn largest_locked_kb(live: &mut LiveLoop) -> u64 {
    let mut largest_kb = 0;
    while live
        .poll_end()
        .map(|run| run.expect("no panic"))
        .is_pending()
    {
        largest_kb = largest_kb.max(locked_kb());
        std::thread::sleep(Duration::from_millis(1));
    }
    largest_kb
}

/// Waits until nothing is locked: the thread of the loop hands over an ended run before it unlocks the memory.
fn wait_until_unlocked(when: &str) {
    let begun = Instant::now();
    while locked_kb() != 0 {
        assert!(begun.elapsed() < TIME_LIMIT, "{when}: {} kB", locked_kb());
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
fn memory_is_locked_only_during_a_run() {
    let config = load(&Source::default()).expect("the default configuration");
    let rig = SimulatedRig::new(&config).expect("a rig");
    let idle = disarmed_run(&config, 0);
    let mut live = LiveLoop::open(Box::new(rig), idle, &config.servo, Pace::Realtime)
        .expect("the thread of the loop");
    if !live.scheduling().memory_locked {
        eprintln!("skipped: this process may not lock its memory (ulimit -l)");
        return;
    }
    for run in 0..2 {
        wait_until_unlocked(&format!("before run {run}"));
        assert!(live.begin(disarmed_run(&config, RUN_TICKS)).is_ok());
        let locked_kb = largest_locked_kb(&mut live);
        assert!(
            locked_kb > 1000,
            "run {run}: program and libraries are locked, not {locked_kb} kB"
        );
    }
    wait_until_unlocked("after the runs");
    let allocated = vec![1_u8; 64 << 20];
    assert_eq!((locked_kb(), allocated.len()), (0, 64 << 20));
}
