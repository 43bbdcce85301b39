//! What the reader thread counts, for whoever wants to know: atomics only, so asking never disturbs the reading.

use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU32, AtomicU64, Ordering::Relaxed};

use super::decoder::Event;
use super::error::Trouble;
use crate::DeviceError;

/// The counts since the probe was opened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Bytes received.
    pub bytes: u64,
    /// Measurements decoded, those out of range and those the probe could not make included.
    pub values: u64,
    /// Of these: handed to the loop. The others had a newer one behind them or no known age.
    pub published: u64,
    /// Of these: older than another that arrived with them, so not handed out.
    pub superseded: u64,
    /// Of these: not handed out because nobody can say when they were made.
    pub unknown_age: u64,
    /// Measurements that the probe's counter says were made and that never arrived.
    pub gaps: u64,
    /// Values received that were not known to be new (not among `values`).
    pub withheld: u64,
    /// Measurements out of range.
    pub out_of_range: u64,
    /// Times the probe said that it cannot measure or did not understand.
    pub faults: u64,
    /// Bytes that belonged to nothing.
    pub damaged_bytes: u64,
    /// Requests without a complete answer in time.
    pub timeouts: u64,
    /// Times the probe's counter went back.
    pub restarts: u64,
    /// Measurements a second over the last half second or more; 0 before.
    pub rate_hz: f64,
    /// Whether the reader thread still runs: it ends when the port is lost.
    pub running: bool,
    /// The latest trouble with port or probe.
    pub last_error: Option<DeviceError>,
}

/// The counters themselves; written by the reader thread only.
#[derive(Debug, Default)]
pub(super) struct Counters {
    pub bytes: AtomicU64,
    pub values: AtomicU64,
    pub published: AtomicU64,
    pub superseded: AtomicU64,
    pub unknown_age: AtomicU64,
    pub gaps: AtomicU64,
    pub withheld: AtomicU64,
    pub out_of_range: AtomicU64,
    pub faults: AtomicU64,
    pub damaged_bytes: AtomicU64,
    pub timeouts: AtomicU64,
    pub restarts: AtomicU64,
    pub rate_bits: AtomicU64,
    pub running: AtomicBool,
    trouble: AtomicU32,
    trouble_code: AtomicI64,
}

/// Adds to a counter that only this thread writes.
pub(super) fn add(counter: &AtomicU64, count: u64) {
    counter.fetch_add(count, Relaxed);
}

impl Counters {
    /// Counts what a decoder said.
    pub(super) fn count(&self, event: Event) {
        match event {
            Event::Value(_) => add(&self.values, 1),
            Event::OutOfRange(_) => {
                add(&self.values, 1);
                add(&self.out_of_range, 1);
            }
            Event::Fault { .. } => {
                add(&self.values, 1);
                add(&self.faults, 1);
            }
            Event::Gap(missed) => add(&self.gaps, missed.into()),
            Event::Withheld(values) => add(&self.withheld, values.into()),
            Event::Restart => {
                add(&self.restarts, 1);
                self.trouble(Trouble::Restart, 0);
            }
            Event::Damaged(bytes) => add(&self.damaged_bytes, bytes.into()),
            Event::Echo | Event::AnswerEnd => {}
        }
    }

    pub(super) fn trouble(&self, trouble: Trouble, code: i64) {
        self.trouble_code.store(code, Relaxed);
        self.trouble.store(trouble as u32, Relaxed);
    }

    pub(super) fn snapshot(&self) -> Statistics {
        let read = |counter: &AtomicU64| counter.load(Relaxed);
        Statistics {
            bytes: read(&self.bytes),
            values: read(&self.values),
            published: read(&self.published),
            superseded: read(&self.superseded),
            unknown_age: read(&self.unknown_age),
            gaps: read(&self.gaps),
            withheld: read(&self.withheld),
            out_of_range: read(&self.out_of_range),
            faults: read(&self.faults),
            damaged_bytes: read(&self.damaged_bytes),
            timeouts: read(&self.timeouts),
            restarts: read(&self.restarts),
            rate_hz: f64::from_bits(read(&self.rate_bits)),
            running: self.running.load(Relaxed),
            last_error: Trouble::describe(
                self.trouble.load(Relaxed),
                self.trouble_code.load(Relaxed),
            ),
        }
    }
}

/// Measurements a second, over windows of half a second or more.
#[derive(Debug, Default)]
pub(super) struct Rate {
    since_ns: u64,
    values: u64,
}

impl Rate {
    const WINDOW_NS: u64 = 500_000_000;

    /// The new rate if a window has passed; `values` is the count since the start.
    pub(super) fn update(&mut self, now_ns: u64, values: u64) -> Option<f64> {
        let window_ns = now_ns.saturating_sub(self.since_ns);
        if window_ns < Self::WINDOW_NS {
            return None;
        }
        let rate_hz = (values - self.values) as f64 / (window_ns as f64 * 1e-9);
        *self = Self {
            since_ns: now_ns,
            values,
        };
        Some(rate_hz)
    }
}
