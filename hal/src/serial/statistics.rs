//! Statistics of the reader thread, in atomics: reading them does not disturb the thread.

use std::sync::atomic::{AtomicBool, AtomicI64, AtomicU32, AtomicU64, Ordering::Relaxed};

use super::decoder::Event;
use super::error::Failure;
use crate::DeviceError;

/// Counts since the probe was opened.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Statistics {
    /// Bytes received.
    pub bytes: u64,
    /// Measurements decoded, including those out of range and those with an error of the probe.
    pub values: u64,
    /// Values passed to the loop.
    pub published: u64,
    /// Values not published, because a newer one arrived with them.
    pub superseded: u64,
    /// Values not published, because their age is unknown.
    pub unknown_age: u64,
    /// Measurements that were made, according to the probe's counter, but did not arrive.
    pub gaps: u64,
    /// Values that were received but may be old (not part of `values`).
    pub withheld: u64,
    /// Measurements out of range.
    pub out_of_range: u64,
    /// Answers with an error of the probe.
    pub faults: u64,
    /// Bytes that do not belong to any message.
    pub damaged_bytes: u64,
    /// Requests without a complete answer before the timeout.
    pub timeouts: u64,
    /// How often the probe's counter went back.
    pub restarts: u64,
    /// Measurements per second over the last half second or more; 0 before.
    pub rate_hz: f64,
    /// Whether the reader thread is running; it ends when the port is lost.
    pub running: bool,
    /// The latest failure of port or probe.
    pub last_error: Option<DeviceError>,
}

/// The counters, written by the reader thread only.
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
    failure: AtomicU32,
    failure_code: AtomicI64,
}

/// Adds to a counter.
pub(super) fn add(counter: &AtomicU64, count: u64) {
    counter.fetch_add(count, Relaxed);
}

fn read(counter: &AtomicU64) -> u64 {
    counter.load(Relaxed)
}

impl Counters {
    /// Counts an event of the decoder.
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
                self.set_failure(Failure::Restart, 0);
            }
            Event::Damaged(bytes) => add(&self.damaged_bytes, bytes.into()),
            Event::Echo | Event::AnswerEnd => {}
        }
    }

    pub(super) fn set_failure(&self, failure: Failure, code: i64) {
        self.failure_code.store(code, Relaxed);
        self.failure.store(failure as u32, Relaxed);
    }

    fn last_error(&self) -> Option<DeviceError> {
        Failure::describe(self.failure.load(Relaxed), self.failure_code.load(Relaxed))
    }

    pub(super) fn snapshot(&self) -> Statistics {
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
            last_error: self.last_error(),
        }
    }
}

/// Measurements per second, over windows of at least half a second.
#[derive(Debug, Default)]
pub(super) struct Rate {
    since_ns: u64,
    values: u64,
}

impl Rate {
    const WINDOW_NS: u64 = 500_000_000;

    /// The rate if a window has passed; `values` is the count since the start.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reports_a_restart_as_the_latest_error() {
        let counters = Counters::default();
        assert_eq!(counters.snapshot().last_error, None);
        counters.count(Event::Restart);
        let statistics = counters.snapshot();
        let error = statistics.last_error.expect("an error");
        assert_eq!(statistics.restarts, 1);
        assert!(error.what.contains("restarted"), "{error}");
    }
}
