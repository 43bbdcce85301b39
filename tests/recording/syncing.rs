//! Syncing to the disk beside the recorder: a slow disk does not stall it, a failing one ends the recording with the reason.
use std::io;
use std::sync::Mutex;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

use bench_recording::{Recorder, Recording, Syncable};
use bench_rt::record::LoopMessage;

use crate::recording::common::{header, tick};

/// A test that waits longer than this has failed. It is not a requirement.
const TIME_LIMIT: Duration = Duration::from_secs(60);

/// A disk that reports each sync, and whose syncs end when the test permits it.
struct StalledDisk {
    begun: Mutex<Sender<()>>,
    permits: Mutex<Receiver<()>>,
}

impl Syncable for StalledDisk {
    fn sync(&self) -> io::Result<()> {
        let _ = self.begun.lock().expect("one user").send(());
        let permits = self.permits.lock().expect("one user");
        // Without a sender, too, the sync ends.
        let _ = permits.recv();
        Ok(())
    }
}

struct FailingDisk;

impl Syncable for FailingDisk {
    fn sync(&self) -> io::Result<()> {
        Err(io::Error::other("the cable of the disk was pulled"))
    }
}

#[test]
fn stalled_sync_does_not_stall_the_recorder() {
    let folder = tempfile::tempdir().expect("temporary directory");
    let path = folder.path().join("run.mcap");
    let file = std::fs::File::create_new(&path).expect("fresh");
    let (permit, permits) = channel();
    let (begun, syncs) = channel();
    let disk = StalledDisk {
        begun: Mutex::new(begun),
        permits: Mutex::new(permits),
    };
    let mut recorder = Recorder::over(Box::new(file), &path, &header())
        .expect("room")
        .synced(Box::new(disk))
        .expect("a thread");
    syncs.recv_timeout(TIME_LIMIT).expect("a sync that waits");
    for number in 0..20_000 {
        recorder
            .record(&LoopMessage::Tick(tick(number)))
            .expect("a good disk");
    }
    drop(permit);
    assert_eq!(recorder.finish(&[]).expect("a good disk").ticks, 20_000);
    let recording = Recording::open(&path).expect("complete");
    assert_eq!(recording.tick_count(), 20_000);
}

#[test]
fn failed_sync_ends_the_recording_with_the_reason() {
    let recorder = || {
        Recorder::over(Box::new(io::sink()), "run.mcap".as_ref(), &header())
            .map(|recorder| recorder.synced(Box::new(FailingDisk)).expect("a thread"))
            .expect("room")
    };
    let at_the_end = recorder().finish(&[]).expect_err("not on the disk");
    assert!(
        at_the_end.to_string().contains("the cable of the disk"),
        "{at_the_end}"
    );

    let mut running = recorder();
    let deadline = Instant::now() + TIME_LIMIT;
    let error = (0..)
        .find_map(|number| {
            assert!(Instant::now() < deadline, "the failure is not reported");
            std::thread::sleep(Duration::from_millis(1));
            running.record(&LoopMessage::Tick(tick(number))).err()
        })
        .expect("an error");
    assert!(
        error.to_string().contains("the cable of the disk"),
        "{error}"
    );
}
