//! State that is shared by the tick and the service thread: atomics, no locks.

use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU8, AtomicU32, Ordering};

use super::super::cia402::{FOLLOWS_TARGET, State};
use super::super::nmt;

/// Intent of the caller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Intent {
    /// No current.
    Off = 0,
    /// On the way to Operation Enabled; target zero.
    Enabling = 1,
    /// Observer commands.
    On = 2,
    /// A person acknowledges a fault: no current, and the fault is looked at anew at the end.
    Resetting = 3,
}

impl Intent {
    /// Whether current may flow, or is about to.
    pub(super) const fn is_in_use(self) -> bool {
        matches!(self, Intent::Enabling | Intent::On)
    }
}

/// No statusword, or no actual current, is known.
const UNKNOWN: u32 = u32::MAX;

/// One writer each, unless said otherwise.
#[derive(Debug)]
pub(super) struct Shared {
    /// Written by the caller.
    intent: AtomicU8,
    /// Counts how often the drive was taken into use, so that the service misses none, however short. By the caller.
    uses: AtomicU32,
    /// Commands sent, by the caller.
    commands: AtomicU32,
    /// The first fault since the last reset, 0 if there is none. Set by both, cleared by the caller.
    fault: AtomicU32,
    /// From the service.
    status: AtomicU32,
    /// Counts status frames.
    status_count: AtomicU32,
    /// In counts; `i32::MAX` if unknown.
    actual: AtomicI32,
    /// Last heartbeat's state.
    nmt: AtomicU8,
    /// Whether the drive restarted since it was configured. Set by the service, cleared by the caller.
    restarted: AtomicBool,
    /// Whether bit 12 must be set while enabled. Written by the caller when the mode is chosen.
    must_follow: AtomicBool,
    /// Code of the last emergency message, 0 if it is gone.
    emergency: AtomicU32,
}

impl Default for Shared {
    fn default() -> Self {
        Shared {
            intent: AtomicU8::new(Intent::Off as u8),
            uses: AtomicU32::new(0),
            commands: AtomicU32::new(0),
            fault: AtomicU32::new(0),
            status: AtomicU32::new(UNKNOWN),
            status_count: AtomicU32::new(0),
            actual: AtomicI32::new(i32::MAX),
            nmt: AtomicU8::new(u8::MAX),
            restarted: AtomicBool::new(false),
            must_follow: AtomicBool::new(false),
            emergency: AtomicU32::new(0),
        }
    }
}

impl Shared {
    pub(super) fn intent(&self) -> Intent {
        match self.intent.load(Ordering::Acquire) {
            1 => Intent::Enabling,
            2 => Intent::On,
            3 => Intent::Resetting,
            _ => Intent::Off,
        }
    }

    pub(super) fn set_intent(&self, intent: Intent) {
        self.intent.store(intent as u8, Ordering::Release);
        if intent.is_in_use() {
            self.uses.fetch_add(1, Ordering::Release);
        }
    }

    pub(super) fn uses(&self) -> u32 {
        self.uses.load(Ordering::Acquire)
    }

    pub(super) fn commands(&self) -> u32 {
        self.commands.load(Ordering::Acquire)
    }

    pub(super) fn note_command(&self) {
        self.commands.fetch_add(1, Ordering::Release);
    }

    pub(super) fn fault(&self) -> u32 {
        self.fault.load(Ordering::Acquire)
    }

    /// Keeps the first fault, but for a code that says more exactly what the first one was.
    pub(super) fn latch(&self, code: u32) {
        let kept = self
            .fault
            .compare_exchange(0, code, Ordering::AcqRel, Ordering::Acquire);
        if kept.is_err_and(|first| super::faults::explains(code, first)) {
            self.fault.store(code, Ordering::Release);
        }
    }

    pub(super) fn clear_fault(&self) {
        self.fault.store(0, Ordering::Release);
    }

    /// The statusword, if one has come since the drive became operational.
    pub(super) fn statusword(&self) -> Option<u16> {
        u16::try_from(self.status.load(Ordering::Acquire)).ok()
    }

    pub(super) fn state(&self) -> Option<State> {
        self.statusword().and_then(State::decode)
    }

    /// Whether the drive follows the target, where it says so.
    pub(super) fn follows(&self) -> bool {
        let bit = self
            .statusword()
            .is_some_and(|word| word & FOLLOWS_TARGET != 0);
        bit || !self.must_follow.load(Ordering::Acquire)
    }

    pub(super) fn set_must_follow(&self, must: bool) {
        self.must_follow.store(must, Ordering::Release);
    }

    pub(super) fn status_count(&self) -> u32 {
        self.status_count.load(Ordering::Acquire)
    }

    pub(super) fn set_status(&self, statusword: u16, actual: i16) {
        self.actual.store(i32::from(actual), Ordering::Release);
        self.status.store(u32::from(statusword), Ordering::Release);
        self.status_count.fetch_add(1, Ordering::Release);
    }

    /// Status frames flow no more: what they said is past.
    pub(super) fn forget_status(&self) {
        self.status.store(UNKNOWN, Ordering::Release);
        self.actual.store(i32::MAX, Ordering::Release);
    }

    pub(super) fn actual(&self) -> Option<i16> {
        i16::try_from(self.actual.load(Ordering::Acquire)).ok()
    }

    pub(super) fn nmt(&self) -> Option<nmt::State> {
        match self.nmt.load(Ordering::Acquire) {
            u8::MAX => None,
            byte => nmt::State::decode(byte),
        }
    }

    pub(super) fn set_nmt(&self, state: nmt::State) {
        self.nmt.store(state as u8, Ordering::Release);
    }

    pub(super) fn forget_nmt(&self) {
        self.nmt.store(u8::MAX, Ordering::Release);
    }

    pub(super) fn restarted(&self) -> bool {
        self.restarted.load(Ordering::Acquire)
    }

    pub(super) fn set_restarted(&self, restarted: bool) {
        self.restarted.store(restarted, Ordering::Release);
    }

    pub(super) fn emergency(&self) -> u16 {
        self.emergency.load(Ordering::Acquire) as u16
    }

    pub(super) fn set_emergency(&self, code: u16) {
        self.emergency.store(u32::from(code), Ordering::Release);
    }
}
