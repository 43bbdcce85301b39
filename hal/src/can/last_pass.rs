//! The last pass of a driver's thread. A state in atomics does not show that its writer hangs, so it is used together with its age.

use std::time::Duration;

use crate::atomics::{AtomicU64, Ordering};

/// Longest time between two passes. A pass waits at most 1 ms for a frame.
pub(super) const PASS_TIMEOUT: Duration = Duration::from_millis(20);

/// When the thread of a driver last completed a pass, on the clock of the host. Written by the thread, read by the tick.
#[derive(Debug, Default)]
pub(super) struct LastPass {
    ns: AtomicU64,
}

impl LastPass {
    pub(super) fn set(&self, now_ns: u64) {
        self.ns.store(now_ns, Ordering::Release);
    }

    /// Whether the thread hangs or has ended: the state that it writes is outdated.
    pub(super) fn is_overdue(&self, now_ns: u64, timeout: Duration) -> bool {
        let age_ns = now_ns.saturating_sub(self.ns.load(Ordering::Acquire));
        Duration::from_nanos(age_ns) > timeout
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pass_is_overdue_after_20_ms() {
        let pass = LastPass::default();
        pass.set(5_000_000);
        assert!(!pass.is_overdue(25_000_000, PASS_TIMEOUT));
        assert!(pass.is_overdue(25_000_001, PASS_TIMEOUT));
        assert!(
            !pass.is_overdue(0, PASS_TIMEOUT),
            "read before a later pass"
        );
    }
}
