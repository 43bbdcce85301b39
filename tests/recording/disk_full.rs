//! A full disk: every write to `/dev/full` fails with "No space left on device".
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

use bench_recording::{
    DiskState, DiskWatch, Health, Recorder, Recording, RecordingError, Shortage, spawn,
};
use bench_rt::record::LoopMessage;
use rtrb::RingBuffer;

use crate::recording::common::{disk_with_room, header, tick};

fn dev_full() -> File {
    OpenOptions::new()
        .write(true)
        .open("/dev/full")
        .expect("Linux has /dev/full")
}

/// A disk with a limited number of free bytes.
struct SmallDisk {
    file: File,
    room: usize,
    full: File,
}

impl Write for SmallDisk {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.room == 0 {
            return self.full.write(bytes);
        }
        let written = self.file.write(&bytes[..bytes.len().min(self.room)])?;
        self.room -= written;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

#[test]
fn reports_full_disk_at_start_with_remedy() {
    let refused = Recorder::over(Box::new(dev_full()), Path::new("full.mcap"), &header())
        .err()
        .expect("full");
    assert!(
        matches!(refused, RecordingError::Write { ticks: 0, .. }),
        "{refused:?}"
    );
    let text = refused.to_string();
    assert!(
        text.contains("full.mcap")
            && text.contains("No space left")
            && text.contains("free some space"),
        "{text}"
    );
}

#[test]
fn disk_full_during_a_run_keeps_draining_and_counting() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("filled.mcap");
    let disk = SmallDisk {
        file: File::create_new(&path).expect("fresh"),
        room: 1 << 20,
        full: dev_full(),
    };
    let recorder = Recorder::over(Box::new(disk), &path, &header()).expect("room for the head");
    let (mut ring, consumer) = RingBuffer::new(1024);
    let handle = spawn(recorder, consumer, disk_with_room(), None).expect("a thread");
    let health = handle.health();

    // 40,000 ticks of about 90 bytes are more than three times the free space.
    let mut failed_after = None;
    for n in 0..40_000 {
        push(&mut ring, LoopMessage::Tick(tick(n)));
        failed_after = failed_after.or(health.failed().then_some(n));
    }
    let failed_after = failed_after.expect("the failure is reported while the loop still runs");
    assert!(
        (5_000..25_000).contains(&failed_after),
        "1 MiB is about 11,000 ticks; reported at {failed_after}"
    );
    drop(ring);

    let error = handle.join().err().expect("the disk was full");
    assert!(error.to_string().contains("No space left"), "{error}");
    assert!(health.failed());
    assert_eq!(
        health.written() + health.discarded(),
        40_000,
        "every record is accounted for"
    );
    assert!(health.discarded() >= 15_000, "{}", health.discarded());
    assert_written_part_readable(&path, health.written());
}

#[test]
fn nearly_full_disk_is_reported_while_the_recording_goes_on() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("whole.mcap");
    let (health, recorder) = record_20_000_ticks(&path, |ticks| DiskState {
        free_bytes: Some(if ticks < 10 { 100_000_000 } else { 99_999_999 }),
        size_bytes: 1_200 * ticks,
    });
    assert_eq!(health.shortage(), Some(Shortage::DiskNearlyFull));
    assert!(!health.failed());
    let totals = recorder.expect("no failure").finish(&[]);
    assert_eq!(totals.expect("complete").ticks, 20_000);
    let recording = Recording::open(&path).expect("whole");
    assert_eq!(
        (recording.truncated(), recording.tick_count()),
        (false, 20_000)
    );
}

#[test]
fn recording_that_ends_at_a_shortage_is_whole_up_to_there() {
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("ended.mcap");
    let sizes = |ticks| DiskState {
        free_bytes: Some(if ticks < 10 { 100_000_000 } else { 99_999_999 }),
        size_bytes: 1_200 * ticks,
    };
    let (health, recorder) = record_20_000(&path, DiskWatch::closing_at_shortage, sizes);
    assert_eq!(health.shortage(), Some(Shortage::DiskNearlyFull));
    assert!(!health.failed());
    assert_eq!((health.written(), health.discarded()), (10_000, 10_000));
    let totals = recorder.expect("no failure").finish(&[]);
    assert_eq!(totals.expect("complete").ticks, 10_000);
    let recording = Recording::open(&path).expect("whole");
    assert_eq!(
        (recording.truncated(), recording.tick_count()),
        (false, 10_000)
    );
}

#[test]
fn recording_that_never_ends_is_cut_50_megabytes_after_its_limit() {
    // 20 MB in each check: above 100 MB at the 6th, 50 MB more at the 9th.
    let dir = tempfile::tempdir().expect("temporary directory");
    let path = dir.path().join("endless.mcap");
    let (health, recorder) = record_20_000_ticks(&path, |checks| DiskState {
        free_bytes: None,
        size_bytes: 20_000_000 * checks,
    });
    assert_eq!(health.shortage(), Some(Shortage::TooLarge));
    assert!(health.failed());
    assert_eq!((health.written(), health.discarded()), (9_000, 11_000));
    let error = recorder.err().expect("a failure");
    assert!(
        matches!(error, RecordingError::Endless { ticks: 9_000, .. }),
        "{error}"
    );
    assert!(error.to_string().contains("bench recover"), "{error}");
}

/// Records ticks on a disk whose state is given by the number of the check, which is made once in 1000 records.
fn record_20_000_ticks(
    path: &Path,
    state: fn(u64) -> DiskState,
) -> (Arc<Health>, Result<Recorder, RecordingError>) {
    record_20_000(path, |disk| disk, state)
}

fn record_20_000(
    path: &Path,
    change: fn(DiskWatch) -> DiskWatch,
    state: fn(u64) -> DiskState,
) -> (Arc<Health>, Result<Recorder, RecordingError>) {
    let checks = AtomicU64::new(0);
    let state = move || state(checks.fetch_add(1, Ordering::Relaxed) + 1);
    let disk = change(DiskWatch::over(Box::new(state), 0));
    let recorder = Recorder::create(path, &header()).expect("a fresh file");
    let (mut ring, consumer) = RingBuffer::new(1024);
    let handle = spawn(recorder, consumer, disk, None).expect("a thread");
    (0..20_000).for_each(|n| push(&mut ring, LoopMessage::Tick(tick(n))));
    drop(ring);
    (handle.health(), handle.join())
}

/// Pushes a message, waiting for a free slot. If the ring stays full, the thread of the recorder has stopped reading it.
fn push(ring: &mut rtrb::Producer<LoopMessage>, published: LoopMessage) {
    let deadline = Instant::now() + Duration::from_secs(60);
    while ring.is_full() {
        assert!(
            Instant::now() < deadline,
            "the recorder no longer reads the ring"
        );
        std::thread::sleep(Duration::from_micros(100));
    }
    ring.push(published).expect("has room");
}

fn assert_written_part_readable(path: &Path, written: u64) {
    let recording = Recording::open(path).expect("readable up to where the disk was full");
    assert!(recording.truncated());
    // The chunk in which the disk filled up (2500 ticks) is lost.
    assert!(
        (written - 2 * 2500..=written).contains(&recording.tick_count()),
        "{}",
        recording.tick_count()
    );
    assert_eq!(
        recording.ticks().expect("readable").count() as u64,
        recording.tick_count()
    );
}
