//! The recorder's own thread, between the loop's ring and the disk.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use rtrb::Consumer;

use super::{Recorder, RecordingError};
use crate::rt::record::LoopMessage;

/// How long the thread rests when the ring is empty: a few ticks at 5 kHz, so the ring hardly fills, and an idle recorder
/// costs next to nothing.
const REST: Duration = Duration::from_millis(1);

/// The thread's nice value.
const NICE: libc::c_int = 15;

/// What a supervisor may look at while the recorder runs.
#[derive(Debug, Default)]
pub struct Health {
    written: AtomicU64,
    thrown_away: AtomicU64,
    failed: AtomicBool,
}

impl Health {
    /// Records (ticks and events) taken from the ring and written; the last half second of them may still be in the
    /// open chunk, which a failure takes with it.
    pub fn written(&self) -> u64 {
        self.written.load(Ordering::Relaxed)
    }

    /// Records taken from the ring after writing had failed: they are in no file.
    pub fn thrown_away(&self) -> u64 {
        self.thrown_away.load(Ordering::Relaxed)
    }

    /// Writing has failed; the run should be stopped. [`RecorderHandle::join`] says why.
    pub fn failed(&self) -> bool {
        self.failed.load(Ordering::Acquire)
    }
}

/// The running thread.
#[derive(Debug)]
pub struct RecorderHandle {
    thread: JoinHandle<Result<Recorder, RecordingError>>,
    health: Arc<Health>,
}

impl RecorderHandle {
    /// Counters to look at from any thread, also after [`RecorderHandle::join`].
    pub fn health(&self) -> Arc<Health> {
        Arc::clone(&self.health)
    }

    /// Waits until the loop has dropped its end of the ring and everything in it is written. The recorder is given back
    /// to be finished with the results; if writing failed, the error instead.
    pub fn join(self) -> Result<Recorder, RecordingError> {
        self.thread.join().unwrap_or_else(|_| {
            Err(RecordingError::Thread {
                what: "died of a panic".into(),
            })
        })
    }
}

/// Starts the thread. It inherits scheduling policy and processor from its maker: call this from an ordinary thread,
/// before any of it is made real-time. It ends when the producer is dropped and the ring is empty.
///
/// If writing fails (a full disk), the thread keeps emptying the ring, so that the loop never notices, counts what it
/// throws away and says so in [`Health`] at once.
pub fn spawn(
    recorder: Recorder,
    ring: Consumer<LoopMessage>,
) -> Result<RecorderHandle, RecordingError> {
    let health = Arc::new(Health::default());
    let seen = Arc::clone(&health);
    let thread = std::thread::Builder::new()
        .name("bench-recorder".into())
        .spawn(move || run(recorder, ring, &seen))
        .map_err(|e| RecordingError::Thread {
            what: format!("could not be started ({e})"),
        })?;
    Ok(RecorderHandle { thread, health })
}

fn run(
    mut recorder: Recorder,
    mut ring: Consumer<LoopMessage>,
    health: &Health,
) -> Result<Recorder, RecordingError> {
    let _alarm = Alarm(health);
    yield_to_others();
    let mut outcome = Ok(());
    loop {
        // Asked before emptying: what was pushed before the producer went is in the ring by then.
        let ended = ring.is_abandoned();
        while let Ok(published) = ring.pop() {
            take(&published, &mut recorder, &mut outcome, health);
        }
        if ended {
            return outcome.map(|()| recorder);
        }
        std::thread::sleep(REST);
    }
}

/// Packing a chunk takes milliseconds, and the ring waits for seconds: whatever else runs, the kernel's own work between a
/// serial port and its reader above all, comes first. Best effort.
#[allow(unsafe_code, reason = "setpriority has no safe wrapper")]
fn yield_to_others() {
    // SAFETY: no memory is touched; 0 is the calling thread, and raising its nice value is always permitted.
    unsafe { libc::setpriority(libc::PRIO_PROCESS, 0, NICE) };
}

/// Reports a recording failure if the recorder thread panics, so that the run does not continue without a recording.
struct Alarm<'a>(&'a Health);

impl Drop for Alarm<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.failed.store(true, Ordering::Release);
        }
    }
}

fn take(
    published: &LoopMessage,
    recorder: &mut Recorder,
    outcome: &mut Result<(), RecordingError>,
    health: &Health,
) {
    if outcome.is_ok() {
        *outcome = recorder.record(published);
        health.failed.store(outcome.is_err(), Ordering::Release);
    }
    let counter = if outcome.is_ok() {
        &health.written
    } else {
        &health.thrown_away
    };
    counter.fetch_add(1, Ordering::Relaxed);
}
