//! Syncs a recording to the disk once per second, in a thread of its own: a slow disk does not stall the recorder, and a power
//! failure loses about the last second.

use std::fs::File;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// Time between two syncs.
const PERIOD: Duration = Duration::from_secs(1);
/// Stack of the thread. It may be locked into memory, because it begins after the thread of the loop.
const STACK_BYTES: usize = 128 << 10;

/// A file whose data can be forced to the disk.
pub trait Syncable: Send + 'static {
    /// Returns when all data written so far are on the disk.
    fn sync(&self) -> io::Result<()>;
}

impl Syncable for File {
    fn sync(&self) -> io::Result<()> {
        self.sync_data()
    }
}

/// The thread that syncs one file.
#[derive(Debug)]
pub(super) struct Syncing {
    thread: JoinHandle<io::Result<()>>,
    has_failed: Arc<AtomicBool>,
    /// The thread syncs once more and ends when this is dropped.
    end: Sender<()>,
}

impl Syncing {
    /// Starts the thread.
    pub(super) fn start(file: Box<dyn Syncable>) -> io::Result<Syncing> {
        let has_failed = Arc::new(AtomicBool::new(false));
        let (end, ended) = channel();
        let failed = Arc::clone(&has_failed);
        let builder = std::thread::Builder::new().name("bench-sync".into());
        let thread = builder.stack_size(STACK_BYTES).spawn(move || {
            let result = sync_until(&ended, file.as_ref());
            failed.store(result.is_err(), Ordering::Release);
            result
        })?;
        Ok(Syncing {
            thread,
            has_failed,
            end,
        })
    }

    /// Whether a sync has failed. Does not wait.
    pub(super) fn has_failed(&self) -> bool {
        self.has_failed.load(Ordering::Acquire)
    }

    /// Syncs once more and ends the thread.
    pub(super) fn finish(self) -> io::Result<()> {
        drop(self.end);
        let ended = self.thread.join();
        ended.unwrap_or_else(|_| Err(io::Error::other("the thread that syncs the file panicked")))
    }
}

/// Syncs in every period until the other end of the channel is dropped, and once more then.
fn sync_until(ended: &Receiver<()>, file: &dyn Syncable) -> io::Result<()> {
    while ended.recv_timeout(PERIOD) == Err(RecvTimeoutError::Timeout) {
        file.sync()?;
    }
    file.sync()
}
