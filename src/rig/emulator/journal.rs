//! What happens to acting devices, as it happens: for people, and for scripts that assert on it.

use std::fmt;
use std::sync::mpsc::{Receiver, Sender, channel};

use serde::Serialize;

use super::stage::seconds;

/// A change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LogEntry {
    /// When, in seconds since the start.
    pub time_s: f64,
    /// `amplifier`, `probe`.
    pub device: &'static str,
    /// `serving`, `state`, `current on`, `current off`, `fault`, `lost`.
    pub what: &'static str,
    /// In words: the state, the fault, the place.
    pub text: String,
    /// Whether the power stage lets current flow.
    pub enabled: bool,
    /// The current that the device gives, in amperes.
    pub current_a: f64,
    /// Where the stage is, in metres.
    pub position_m: f64,
    /// For `current off`: when the current became zero, in seconds since the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub since_s: Option<f64>,
}

impl fmt::Display for LogEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let LogEntry {
            time_s,
            device,
            what,
            text,
            current_a,
            position_m,
            ..
        } = self;
        write!(f, "{time_s:10.4} s  {device:<9}  {what:<11}  {text}")?;
        match self.since_s {
            Some(since_s) => write!(f, "  since {since_s:.4} s")?,
            None if *what == "serving" => return Ok(()),
            None => {}
        }
        write!(f, "  ({current_a:.3} A, {:.2} um)", position_m * 1e6)
    }
}

/// Where a device writes its changes; clones write to the same place.
#[derive(Clone, Debug)]
pub struct EventLog(Sender<LogEntry>);

impl EventLog {
    /// A journal and where it is read.
    pub fn new() -> (EventLog, Receiver<LogEntry>) {
        let (sender, receiver) = channel();
        (EventLog(sender), receiver)
    }

    /// Writes; if nobody reads any more, nobody misses it.
    pub fn write(&self, entry: LogEntry) {
        let _ = self.0.send(entry);
    }
}

/// Current on and off: while the power stage is enabled, zero counts as off only after a while, for a run passes through
/// zero all the time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CurrentWatch {
    is_on: bool,
    zero_since_ns: Option<u64>,
}

/// What a watch has found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Turned {
    On,
    Off { since_s: f64 },
}

impl CurrentWatch {
    /// So long a current must be zero to be off, if it could flow.
    const OFF_NS: u64 = 250_000_000;

    pub(super) fn see(&mut self, now_ns: u64, current_a: f64, is_enabled: bool) -> Option<Turned> {
        if current_a != 0.0 {
            self.zero_since_ns = None;
            return (!std::mem::replace(&mut self.is_on, true)).then_some(Turned::On);
        }
        let since_ns = *self.zero_since_ns.get_or_insert(now_ns);
        let is_over =
            self.is_on && (!is_enabled || now_ns.saturating_sub(since_ns) >= Self::OFF_NS);
        self.is_on &= !is_over;
        is_over.then_some(Turned::Off {
            since_s: seconds(since_ns),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_current_is_off_when_none_can_flow_or_when_it_has_been_zero_for_a_while() {
        let mut watch = CurrentWatch::default();
        let mut see =
            |ms: u64, current_a, is_enabled| watch.see(ms * 1_000_000, current_a, is_enabled);
        assert_eq!(see(0, 0.0, false), None, "off from the start is no news");
        assert_eq!(see(10, 0.5, true), Some(Turned::On));
        assert_eq!(see(11, 0.0, true), None, "a sweep passes through zero");
        assert_eq!(see(12, -0.5, true), None);
        assert_eq!([see(20, 0.0, true), see(269, 0.0, true)], [None; 2]);
        assert_eq!(
            see(270, 0.0, true),
            Some(Turned::Off {
                since_s: seconds(20_000_000)
            })
        );
        assert_eq!(see(900, 0.0, true), None);
        assert_eq!(see(1000, 0.1, true), Some(Turned::On));
        assert_eq!(
            see(1001, 0.0, false),
            Some(Turned::Off {
                since_s: seconds(1_001_000_000)
            }),
            "at once"
        );
    }
}
