//! State that the tick and the service thread share, in atomics, without locks.

use super::super::cia402::{FOLLOWS_TARGET, State};
use super::super::last_pass::LastPass;
use super::super::nmt;
use crate::atomics::{AtomicBool, AtomicI32, AtomicU8, AtomicU32, Ordering};

/// Intent of the caller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub(super) enum Intent {
    /// No current.
    Off = 0,
    /// The drive is being enabled; the target is zero.
    Enabling = 1,
    /// The drive follows commands.
    On = 2,
    /// The operator acknowledges a fault. There is no current; faults are checked again at the end.
    Resetting = 3,
}

impl Intent {
    /// Whether current may flow now, or as soon as the drive is enabled.
    pub(super) const fn is_in_use(self) -> bool {
        matches!(self, Intent::Enabling | Intent::On)
    }
}

/// No statusword, or no actual current, is known.
const UNKNOWN: u32 = u32::MAX;

/// Each field has one writer, unless stated otherwise. The caller is the thread of the loop.
#[derive(Debug)]
pub(super) struct Shared {
    /// Written by the caller, and by the reset thread at the end of a reset.
    intent: AtomicU8,
    /// Number of requests to reset a fault. Written by the caller.
    resets: AtomicU32,
    /// How often the drive was enabled, so that the service also notices a short use. Written by the caller.
    uses: AtomicU32,
    /// Number of commands sent. Written by the caller.
    commands: AtomicU32,
    /// The first fault since the last reset, 0 if there is none. Written by both, cleared by the reset thread.
    fault: AtomicU32,
    /// The statusword, or `UNKNOWN`. Written by the service.
    status: AtomicU32,
    /// Number of status frames.
    status_count: AtomicU32,
    /// Actual current in counts; `i32::MAX` if unknown.
    actual: AtomicI32,
    /// State in the last heartbeat; `u8::MAX` if unknown.
    nmt: AtomicU8,
    /// Whether the drive restarted since it was configured. Set by the service, cleared by the reset thread.
    restarted: AtomicBool,
    /// Whether bit 12 of the statusword must be set while enabled. Written by the reset thread when the mode is chosen.
    must_follow: AtomicBool,
    /// Code of the last emergency message, 0 if its cause is removed.
    emergency: AtomicU32,
    /// Written by the service. Without a recent pass the fields above are outdated.
    pub(super) last_pass: LastPass,
}

impl Default for Shared {
    fn default() -> Self {
        Shared {
            intent: AtomicU8::new(Intent::Off as u8),
            resets: AtomicU32::new(0),
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
            last_pass: LastPass::default(),
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
        // An exchange, as in `end_reset`: exchanges have one order, so that the newer intent of the caller remains.
        self.intent.swap(intent as u8, Ordering::AcqRel);
        if intent.is_in_use() {
            self.uses.fetch_add(1, Ordering::Release);
        }
    }

    /// Asks the reset thread to reset the fault.
    pub(super) fn request_reset(&self) {
        self.set_intent(Intent::Resetting);
        self.resets.fetch_add(1, Ordering::Release);
    }

    pub(super) fn resets(&self) -> u32 {
        self.resets.load(Ordering::Acquire)
    }

    /// Ends the intent to reset, unless the caller has already replaced it.
    pub(super) fn end_reset(&self) {
        let (from, to) = (Intent::Resetting as u8, Intent::Off as u8);
        let _ = self
            .intent
            .compare_exchange(from, to, Ordering::AcqRel, Ordering::Acquire);
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

    /// Stores the first fault. A later code replaces it only if it describes the same fault more precisely.
    pub(super) fn latch(&self, code: u32) {
        let stored = self
            .fault
            .compare_exchange(0, code, Ordering::AcqRel, Ordering::Acquire);
        if stored.is_err_and(|first| super::faults::explains(code, first)) {
            self.fault.store(code, Ordering::Release);
        }
    }

    pub(super) fn clear_fault(&self) {
        self.fault.store(0, Ordering::Release);
    }

    /// The statusword, if one was received since the drive became operational.
    pub(super) fn statusword(&self) -> Option<u16> {
        u16::try_from(self.status.load(Ordering::Acquire)).ok()
    }

    pub(super) fn state(&self) -> Option<State> {
        self.statusword().and_then(State::decode)
    }

    /// Whether the drive follows the target; always true in a mode that does not report it.
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

    /// Discards the last status: the drive no longer sends status frames.
    pub(super) fn clear_status(&self) {
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

    /// Whether the last heartbeat reports operational.
    pub(super) fn is_operational(&self) -> bool {
        self.nmt() == Some(nmt::State::Operational)
    }

    /// Whether the drive is off, or there is nothing more to wait for: its state is unknown, or there is a fault.
    pub(super) fn has_settled(&self) -> bool {
        self.state().is_none_or(State::is_off) || self.fault() != 0
    }

    pub(super) fn set_nmt(&self, state: nmt::State) {
        self.nmt.store(state as u8, Ordering::Release);
    }

    pub(super) fn clear_nmt(&self) {
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

    /// The counts of uses, commands and status frames as after `count` of each.
    #[cfg(test)]
    pub(super) fn set_counts(&self, count: u32) {
        for value in [&self.uses, &self.commands, &self.status_count] {
            value.store(count, Ordering::Release);
        }
    }
}
