//! The memory of the process is locked while the loop runs, and only then. This is the only test of its process, because the lock
//! is that of the whole process.

use std::sync::Arc;

use bench::config::{Source, load};
use bench::rig::simulated::SimulatedRig;
use bench::rt::interlock::Interlocks;
use bench::rt::publisher::Publisher;
use bench::rt::request::RequestSender;
use bench::rt::servo::{Connections, Progress, Servo};
use bench::rt::thread::{Pace, prepare};
use rtrb::RingBuffer;

/// `VmLck` of this process in kilobytes.
fn locked_kb() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("Linux");
    let line = status.lines().find_map(|line| line.strip_prefix("VmLck:"));
    let value = line.and_then(|line| line.trim().strip_suffix(" kB"));
    value.expect("a size").trim().parse().expect("a number")
}

#[test]
fn memory_is_locked_only_while_the_loop_lives() {
    let config = load(&Source::default()).expect("the default configuration");
    let (publisher, _records) = RingBuffer::new(1 << 12);
    let (_requests, taken) = RequestSender::ring(4);
    let (retired, _retired) = RingBuffer::new(4);
    let connections = Connections {
        requests: taken,
        retired,
        publisher: Publisher::new(publisher),
        progress: Arc::new(Progress::default()),
    };
    let interlocks = Interlocks::new(
        &config.interlock,
        &config.amplifier,
        &config.motor,
        &config.servo,
    );
    let rig = SimulatedRig::new(&config).expect("a rig");
    let servo = Servo::new(Box::new(rig), interlocks, connections);
    assert_eq!(locked_kb(), 0);
    let prepared = prepare(servo, &config.servo, Pace::Realtime, 10).expect("a thread");
    if !prepared.scheduling().memory_locked {
        eprintln!("skipped: this process may not lock its memory (ulimit -l)");
        return;
    }
    assert!(locked_kb() > 1000, "program and libraries are locked");
    prepared.begin().join().expect("no panic");
    assert_eq!(locked_kb(), 0);
    let allocated = vec![1_u8; 64 << 20];
    assert_eq!((locked_kb(), allocated.len()), (0, 64 << 20));
}
