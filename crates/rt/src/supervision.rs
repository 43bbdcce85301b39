//! What ends a run without a request: stop flags, which a signal handler sets, and the arm lease, which the supervisor renews. The
//! loop reads both in every tick. Stopping therefore needs neither a free thread nor room in a ring.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use super::request::Request;

/// One flag for each signal that stops a run. A flag holds one signal until the next tick takes it.
#[derive(Clone, Debug, Default)]
pub struct StopFlags {
    flags: [Arc<AtomicBool>; 4],
    /// Whether [`StopFlags::raise`] was called, also if a tick has taken the flag.
    was_raised: Arc<AtomicBool>,
}

impl StopFlags {
    /// The flags, for the handlers of different signals.
    pub fn flags(&self) -> &[Arc<AtomicBool>] {
        &self.flags
    }

    /// Whether the runs with these flags were stopped by [`StopFlags::raise`].
    pub fn was_raised(&self) -> bool {
        self.was_raised.load(Ordering::Relaxed)
    }

    /// Whether a flag is set that no tick has taken yet.
    pub fn is_raised(&self) -> bool {
        self.flags.iter().any(|flag| flag.load(Ordering::Relaxed))
    }

    /// Sets the first flag that is not set.
    pub fn raise(&self) {
        self.was_raised.store(true, Ordering::Relaxed);
        let mut flags = self.flags.iter();
        let _ = flags.find(|flag| !flag.swap(true, Ordering::Relaxed));
    }

    /// Number of flags that were set since the last call.
    fn take(&self) -> usize {
        // A load is cheaper than an exchange, and almost always enough.
        let set = self
            .flags
            .iter()
            .filter(|flag| flag.load(Ordering::Relaxed));
        set.filter(|flag| flag.swap(false, Ordering::Relaxed))
            .count()
    }
}

/// A counter that the supervisor increments while it runs.
#[derive(Debug, Default)]
pub struct ArmLease(AtomicU64);

impl ArmLease {
    /// Renews the lease.
    pub fn renew(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }
}

/// The loop's view of an [`ArmLease`]. It measures time in ticks: every tick counts, also a missed one.
#[derive(Debug)]
pub struct LeaseWatch {
    lease: Arc<ArmLease>,
    renewals: u64,
    ticks: u64,
    limit_ticks: u64,
}

impl LeaseWatch {
    /// A lease that expires `limit_ticks` after its last renewal.
    pub fn new(lease: Arc<ArmLease>, limit_ticks: u64) -> Self {
        LeaseWatch {
            lease,
            renewals: 0,
            ticks: 0,
            limit_ticks,
        }
    }

    /// Counts a tick and the missed ticks before it; returns whether the lease has expired.
    fn has_expired(&mut self, missed: u32) -> bool {
        let renewals = self.lease.0.load(Ordering::Relaxed);
        self.ticks = if renewals == self.renewals {
            self.ticks.saturating_add(1 + u64::from(missed))
        } else {
            0
        };
        self.renewals = renewals;
        self.ticks >= self.limit_ticks
    }
}

/// Stop flags and arm lease, as the loop reads them.
#[derive(Debug, Default)]
pub(super) struct Supervision {
    pub(super) flags: StopFlags,
    /// `None`: a loop in virtual pace, or one whose runs need no supervisor.
    pub(super) lease: Option<LeaseWatch>,
    signals: usize,
}

impl Supervision {
    /// The requests for the signals since the last tick, in their order: the first signal of a run ends it along a ramp, the second
    /// one cuts the current.
    pub(super) fn signalled(&mut self) -> impl Iterator<Item = Request> + use<> {
        let before = self.signals;
        self.signals = before.saturating_add(self.flags.take());
        let requests = [Request::Finish, Request::Stop];
        let new = self.signals - before;
        requests.into_iter().skip(before).take(new)
    }

    /// Counts a tick and the missed ticks before it; returns whether the arm lease has expired.
    pub(super) fn lease_expired(&mut self, missed: u32) -> bool {
        let lease = self.lease.as_mut();
        lease.is_some_and(|lease| lease.has_expired(missed))
    }
}
