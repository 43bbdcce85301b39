//! The thread that writes messages from the ring to the disk.
use std::time::{Duration, Instant};

use bench_recording::{Recorder, Recording, spawn};
use bench_rt::record::{Event, EventKind, LoopMessage};
use rtrb::RingBuffer;

use crate::recording::common::{disk_with_room, header, run, tick};

#[test]
fn recording_contains_all_messages_sent_before_the_loop_ended() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("run.mcap");
    let published = run(20_000);
    let (mut ring, consumer) = RingBuffer::new(published.len());
    let handle = spawn(
        Recorder::create(&path, &header()).expect("fresh"),
        consumer,
        disk_with_room(),
        None,
    )
    .expect("a thread");
    let health = handle.health();
    published
        .iter()
        .for_each(|p| ring.push(*p).expect("a ring for all"));
    drop(ring);

    let recorder = handle.join().expect("a good disk");
    assert_eq!(recorder.ticks(), 20_000);
    let totals = recorder
        .finish(&[("result.json", "application/json", b"{}")])
        .expect("a good disk");
    assert_eq!(
        (totals.ticks, totals.events, totals.lost_records),
        (20_000, 3, 0)
    );
    assert_eq!(
        (health.written(), health.discarded(), health.failed()),
        (20_003, 0, false)
    );
    let recording = Recording::open(&path).expect("complete");
    assert_eq!(
        (recording.tick_count(), recording.truncated()),
        (20_000, false)
    );
    assert!(recording.attachment("result.json").is_some());
}

#[test]
fn messages_beyond_the_ring_capacity_are_counted_as_lost() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("lossy.mcap");
    let (mut ring, consumer) = RingBuffer::new(100);
    // The recorder starts after the loop: of 150 ticks the ring holds 100, and one event reports the other 50.
    let refused = (0..150)
        .filter(|n| ring.push(LoopMessage::Tick(tick(*n))).is_err())
        .count() as u64;
    assert_eq!(refused, 50);
    let handle = spawn(
        Recorder::create(&path, &header()).expect("fresh"),
        consumer,
        disk_with_room(),
        None,
    )
    .expect("a thread");
    let deadline = Instant::now() + Duration::from_secs(60);
    while ring.slots() < 100 {
        assert!(
            Instant::now() < deadline,
            "the recorder does not read the ring"
        );
        std::thread::sleep(Duration::from_millis(1));
    }
    ring.push(LoopMessage::Event(Event {
        tick: 150,
        kind: EventKind::Lost { records: refused },
    }))
    .expect("room");
    ring.push(LoopMessage::Tick(tick(150))).expect("room");
    drop(ring);

    let totals = handle
        .join()
        .expect("a good disk")
        .finish(&[])
        .expect("a good disk");
    assert_eq!(
        (totals.ticks, totals.lost_records, totals.overruns),
        (101, 50, 0)
    );
    assert_eq!(Recording::open(&path).expect("complete").lost_records(), 50);
}
