//! State that the tick and the thread of the driver share, in atomics, without locks.

use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU32, Ordering};

use super::super::last_pass::LastPass;

/// State that the tick and the thread of the driver share.
#[derive(Debug, Default)]
pub(super) struct Shared {
    /// Whether commands are followed. Written by the tick.
    pub(super) is_on: AtomicBool,
    /// How often the VESC was enabled, so that a short use is noticed as well. Written by the tick.
    pub(super) uses: AtomicU32,
    /// Number of commands since it was enabled. Written by the tick.
    pub(super) commands: AtomicU32,
    /// The value of `uses` for which the repeats of SET_CURRENT 0 have ended. Written by the thread.
    pub(super) ended_uses: AtomicU32,
    pub(super) fault: AtomicU32,
    pub(super) is_heard: AtomicBool,
    /// Number of STATUS frames.
    pub(super) status_count: AtomicU32,
    pub(super) current_tenths: AtomicI32,
    /// Written by the thread. Without a recent pass its fields are outdated.
    pub(super) last_pass: LastPass,
}

impl Shared {
    pub(super) fn latch(&self, code: u32) {
        let _ = self
            .fault
            .compare_exchange(0, code, Ordering::AcqRel, Ordering::Acquire); // the first fault is kept
    }

    pub(super) fn switch(&self, is_on: bool) {
        if is_on {
            self.commands.store(0, Ordering::Release);
            self.uses.fetch_add(1, Ordering::Release);
        }
        self.is_on.store(is_on, Ordering::Release);
    }

    /// Whether the VESC is off and zero current is no longer repeated.
    pub(super) fn has_settled(&self) -> bool {
        self.ended_uses.load(Ordering::Acquire) == self.uses.load(Ordering::Acquire)
    }
}
