//! What other threads do with a rig while its loop goes on: they stop the run, change it, and watch it.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use rtrb::{Consumer, RingBuffer};

use super::run::StopCause;
use bench_recording::LiveCopy;
use bench_rt::record::LoopMessage;
use bench_rt::supervision::{ArmLease, StopFlags};
use bench_rt::tuning::Tune;

/// Slots of the ring of a live view: 1.6 s at 5 kHz.
pub(super) const FEED_SLOTS: usize = 1 << 13;

/// What the messages of a feed belong to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FeedSource {
    /// The loop between two runs.
    Idle,
    /// A run.
    Run,
}

/// Messages of the loop for a live view, until the ring is abandoned.
pub struct Feed {
    /// What they belong to.
    pub source: FeedSource,
    /// Sampling period in seconds.
    pub period_s: f64,
    /// The messages.
    pub messages: Consumer<LoopMessage>,
}

/// Where feeds are sent to, and how many messages did not fit into their rings.
#[derive(Clone, Debug)]
pub struct FeedSender {
    feeds: Sender<Feed>,
    dropped: Arc<AtomicU64>,
}

impl FeedSender {
    /// A sender and its receiver.
    pub fn channel() -> (FeedSender, Receiver<Feed>) {
        let (feeds, received) = channel();
        let dropped = Arc::default();
        (FeedSender { feeds, dropped }, received)
    }

    /// Messages of runs that the live view did not take in time.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Sends a feed. Without a receiver nobody watches.
    pub(crate) fn send(&self, source: FeedSource, period_s: f64, messages: Consumer<LoopMessage>) {
        let feed = Feed {
            source,
            period_s,
            messages,
        };
        let _ = self.feeds.send(feed);
    }

    /// The copy of a recording.
    fn copy(&self, period_s: f64) -> LiveCopy {
        let (ring, messages) = RingBuffer::new(FEED_SLOTS);
        self.send(FeedSource::Run, period_s, messages);
        LiveCopy::new(ring, Arc::clone(&self.dropped))
    }
}

/// Why the run in progress, or the last one, cannot be recorded. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct RecordingDefect(Arc<Mutex<Option<StopCause>>>);

impl RecordingDefect {
    /// The cause; `None` if there is none.
    pub fn get(&self) -> Option<StopCause> {
        *self.lock()
    }

    /// Sets the first cause of a run. Returns whether it is the first one.
    pub(crate) fn set(&self, cause: StopCause) -> bool {
        let mut present = self.lock();
        let is_first = present.is_none();
        present.get_or_insert(cause);
        is_first
    }

    /// A run begins.
    pub(crate) fn clear(&self) {
        *self.lock() = None;
    }

    fn lock(&self) -> MutexGuard<'_, Option<StopCause>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Number of runs that an interlock ended, with the last reason. Clones share it.
#[derive(Clone, Debug, Default)]
pub struct TripCount(Arc<Mutex<(u64, &'static str)>>);

impl TripCount {
    /// The number, and the reason of the last trip.
    pub fn get(&self) -> (u64, &'static str) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Counts a trip.
    pub(crate) fn add(&self, reason: &'static str) {
        let mut count = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *count = (count.0.saturating_add(1), reason);
    }
}

/// Handles on the run of a rig. Clones belong to the same rig.
#[derive(Clone, Debug)]
pub struct RunHooks {
    /// Ends the run in progress: raised once it settles, raised twice the current is cut.
    pub stop: StopFlags,
    tunes: Sender<Tune>,
    sent_tunes: Arc<Mutex<Receiver<Tune>>>,
    feeds: Option<FeedSender>,
    /// Why the run in progress, or the last one, cannot be recorded.
    pub recording_defect: RecordingDefect,
    /// Counts the runs that an interlock ended.
    pub trips: TripCount,
    /// The arm lease of the run, if its client renews it; `None` if its supervisor does.
    pub(super) lease: Option<Arc<ArmLease>>,
    /// Whether the stop signals of this process end the run.
    pub(super) has_signals: bool,
}

impl Default for RunHooks {
    fn default() -> RunHooks {
        let (tunes, sent) = channel();
        RunHooks {
            stop: StopFlags::default(),
            tunes,
            sent_tunes: Arc::new(Mutex::new(sent)),
            feeds: None,
            recording_defect: RecordingDefect::default(),
            trips: TripCount::default(),
            lease: None,
            has_signals: true,
        }
    }
}

impl RunHooks {
    /// Hooks of a rig that is watched. Its runs are ended by the stop flags only, not by signals of this process.
    pub fn watched(feeds: FeedSender) -> RunHooks {
        RunHooks {
            feeds: Some(feeds),
            has_signals: false,
            ..RunHooks::default()
        }
    }

    /// The same rig, with stop flags of the next run, and its arm lease if its client renews it.
    pub fn with_stop(&self, stop: StopFlags, lease: Option<Arc<ArmLease>>) -> RunHooks {
        RunHooks {
            stop,
            lease,
            ..self.clone()
        }
    }

    /// Changes the reference or the loop gain of the run in progress. Whoever sends a change must have checked it with
    /// [`check_tune`](crate::check_tune). What is sent between runs is discarded.
    pub fn tuner(&self) -> Sender<Tune> {
        self.tunes.clone()
    }

    /// The changes that were sent since the last call.
    pub(super) fn take_tunes(&self) -> Vec<Tune> {
        let sent = self.sent_tunes.lock();
        let sent = sent.unwrap_or_else(PoisonError::into_inner);
        sent.try_iter().collect()
    }

    /// Who watches the loop.
    pub(super) fn feeds(&self) -> Option<&FeedSender> {
        self.feeds.as_ref()
    }

    /// The copy of a recording for a live view.
    pub(super) fn live_copy(&self, period_s: f64) -> Option<LiveCopy> {
        self.feeds.as_ref().map(|feeds| feeds.copy(period_s))
    }
}
