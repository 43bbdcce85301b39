//! The thread of the recorder, between the ring of the loop and the disk.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};
use std::thread::JoinHandle;
use std::time::Duration;

use rtrb::{Consumer, Producer};

use super::disk::{DiskWatch, Shortage, Space};
use super::{Recorder, RecordingError};
use bench_base::thread_priority::lower;
use bench_rt::record::LoopMessage;

/// Pause of the thread when the ring is empty: 5 ticks at 5 kHz, so the ring stays nearly empty and an idle recorder needs
/// almost no processor time.
const IDLE_PAUSE: Duration = Duration::from_millis(1);

/// Records between two checks of the disk, at most 120 kB.
const RECORDS_PER_CHECK: u64 = 1000;

/// Nice value of the thread. Compressing a chunk takes milliseconds, while the ring holds seconds: everything else is more urgent,
/// above all the work of the kernel between a serial port and its reader.
const NICE: i32 = 15;

/// The state of a running recorder, for a supervisor.
#[derive(Debug, Default)]
pub struct Health {
    written: AtomicU64,
    discarded: AtomicU64,
    failed: AtomicBool,
    shortage: OnceLock<Shortage>,
}

impl Health {
    /// Records (ticks and events) that were taken from the ring and written. The last half second of them may still be in the
    /// open chunk, which is lost in a failure.
    pub fn written(&self) -> u64 {
        self.written.load(Ordering::Relaxed)
    }

    /// Records that were taken from the ring after the recording had failed or ended. They are in no file.
    pub fn discarded(&self) -> u64 {
        self.discarded.load(Ordering::Relaxed)
    }

    /// Why the run must end although writing still succeeds: the recording is too large for the disk or for its plan.
    pub fn shortage(&self) -> Option<Shortage> {
        self.shortage.get().copied()
    }

    /// Whether writing has failed: the run should be stopped. [`RecorderHandle::join`] returns the reason.
    pub fn failed(&self) -> bool {
        self.failed.load(Ordering::Acquire)
    }
}

/// A running recorder.
#[derive(Debug)]
pub struct RecorderHandle {
    thread: JoinHandle<Result<Recorder, RecordingError>>,
    health: Arc<Health>,
    path: PathBuf,
}

impl RecorderHandle {
    /// The state, for any thread, also after [`RecorderHandle::join`].
    pub fn health(&self) -> Arc<Health> {
        Arc::clone(&self.health)
    }

    /// Waits until the loop has dropped its end of the ring and everything in it is written. Returns the recorder, to which the
    /// results can be added; fails if writing failed.
    pub fn join(self) -> Result<Recorder, RecordingError> {
        let path = self.path;
        let joined = self.thread.join();
        joined.unwrap_or_else(|_| Err(RecordingError::Panicked { path }))
    }
}

/// A copy of everything that is recorded, for a live view. It never delays the recorder: what does not fit is counted.
pub struct LiveCopy {
    ring: Producer<LoopMessage>,
    dropped: Arc<AtomicU64>,
}

impl LiveCopy {
    /// A copy into `ring`. `dropped` counts the messages that do not fit.
    pub fn new(ring: Producer<LoopMessage>, dropped: Arc<AtomicU64>) -> LiveCopy {
        LiveCopy { ring, dropped }
    }

    fn push(&mut self, published: &LoopMessage) {
        if self.ring.push(*published).is_err() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }
}

/// Starts the thread. It inherits scheduling policy and processor from the calling thread, which therefore must not be a
/// real-time thread. It ends when the producer is dropped and the ring is empty.
///
/// If writing fails (for example because the disk is full), the thread continues to empty the ring, so that the loop is not
/// affected. It counts the lost records and reports the failure in [`Health`] at once. A shortage of disk space is reported there
/// as well; the recording goes on to the end of the run, or ends at once with [`DiskWatch::closing_at_shortage`].
pub fn spawn(
    recorder: Recorder,
    ring: Consumer<LoopMessage>,
    disk: DiskWatch,
    copy: Option<LiveCopy>,
) -> Result<RecorderHandle, RecordingError> {
    let health = Arc::new(Health::default());
    let shared = Arc::clone(&health);
    let path = recorder.path().to_path_buf();
    let thread = std::thread::Builder::new()
        .name("bench-recorder".into())
        .spawn(move || run(recorder, ring, disk, copy, &shared))
        .map_err(|source| RecordingError::NotStarted {
            path: path.clone(),
            source,
        })?;
    Ok(RecorderHandle {
        thread,
        health,
        path,
    })
}

fn run(
    mut recorder: Recorder,
    mut ring: Consumer<LoopMessage>,
    mut disk: DiskWatch,
    mut copy: Option<LiveCopy>,
    health: &Health,
) -> Result<Recorder, RecordingError> {
    let _alarm = Alarm(health);
    lower(NICE);
    let mut writing = Writing::On;
    loop {
        // Read before the ring is emptied: everything that was pushed before the producer was dropped is then in the ring.
        let ended = ring.is_abandoned();
        while let Ok(published) = ring.pop() {
            if let Some(copy) = &mut copy {
                copy.push(&published);
            }
            take(&published, &mut recorder, &mut writing, health);
            if writing.is_on() && health.written().is_multiple_of(RECORDS_PER_CHECK) {
                writing = check_disk(&mut disk, &recorder, health);
            }
        }
        if ended {
            return match writing {
                Writing::On | Writing::Ended => Ok(recorder),
                Writing::Failed(error) => Err(error),
            };
        }
        std::thread::sleep(IDLE_PAUSE);
    }
}

/// Whether records are still written.
enum Writing {
    On,
    /// The recording has ended before the run, and is complete up to there.
    Ended,
    Failed(RecordingError),
}

impl Writing {
    fn is_on(&self) -> bool {
        matches!(self, Writing::On)
    }
}

/// Reports a shortage. Fails if the run goes on in spite of it.
fn check_disk(disk: &mut DiskWatch, recorder: &Recorder, health: &Health) -> Writing {
    match disk.check() {
        Space::Enough => Writing::On,
        Space::Short(shortage) => {
            health.shortage.get_or_init(|| shortage);
            Writing::On
        }
        Space::Closed(shortage) => {
            health.shortage.get_or_init(|| shortage);
            Writing::Ended
        }
        Space::Exhausted => {
            health.failed.store(true, Ordering::Release);
            Writing::Failed(RecordingError::Endless {
                path: recorder.path().into(),
                ticks: recorder.ticks(),
            })
        }
    }
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

fn take(published: &LoopMessage, recorder: &mut Recorder, writing: &mut Writing, health: &Health) {
    if writing.is_on()
        && let Err(error) = recorder.record(published)
    {
        *writing = Writing::Failed(error);
        health.failed.store(true, Ordering::Release);
    }
    let counter = if writing.is_on() {
        &health.written
    } else {
        &health.discarded
    };
    counter.fetch_add(1, Ordering::Relaxed);
}
