//! The log of emulated devices: lines for the operator, and JSON objects for scripts.

use std::fmt;
use std::sync::mpsc::{Receiver, Sender, channel};

use serde::Serialize;

use super::EmulatedDevice;
use super::stage::seconds;

/// A change, and the state of amplifier and stage at that time.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LogEntry {
    /// Seconds since the start.
    pub time_s: f64,
    /// The device that changed.
    pub device: EmulatedDevice,
    /// Kind of the change.
    pub what: LogEvent,
    /// The state, the fault or the place.
    pub text: String,
    /// Whether the power stage is enabled.
    pub enabled: bool,
    /// The current of the amplifier, in amperes.
    pub current_a: f64,
    /// Displacement of the stage, in metres.
    pub position_m: f64,
    /// For [`LogEvent::CurrentOff`]: when the current became zero, in seconds since the start.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub since_s: Option<f64>,
}

/// Kind of a change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum LogEvent {
    /// The device serves its interface from now on.
    Serving,
    /// The state of the amplifier.
    State,
    /// A current begins.
    #[serde(rename = "current on")]
    CurrentOn,
    /// The current has ended.
    #[serde(rename = "current off")]
    CurrentOff,
    /// A fault begins or ends.
    Fault,
    /// The serial port is gone.
    Lost,
    /// A setting that the port did not accept.
    Note,
}

impl LogEvent {
    /// The name in the log.
    pub fn name(self) -> &'static str {
        match self {
            LogEvent::Serving => "serving",
            LogEvent::State => "state",
            LogEvent::CurrentOn => "current on",
            LogEvent::CurrentOff => "current off",
            LogEvent::Fault => "fault",
            LogEvent::Lost => "lost",
            LogEvent::Note => "note",
        }
    }
}

impl fmt::Display for LogEntry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (device, what) = (self.device.name(), self.what.name());
        write!(
            f,
            "{:10.4} s  {device:<9}  {what:<11}  {}",
            self.time_s, self.text
        )?;
        if let Some(since_s) = self.since_s {
            write!(f, "  since {since_s:.4} s")?;
        } else if self.what == LogEvent::Serving {
            return Ok(());
        }
        let position_um = self.position_m * 1e6;
        write!(f, "  ({:.3} A, {position_um:.2} um)", self.current_a)
    }
}

/// The log to which devices report their changes; clones write to the same log.
#[derive(Clone, Debug)]
pub struct EventLog(Sender<LogEntry>);

impl EventLog {
    /// A log, and the end where it is read.
    pub fn new() -> (EventLog, Receiver<LogEntry>) {
        let (sender, receiver) = channel();
        (EventLog(sender), receiver)
    }

    /// Appends an entry. Without a reader the entry is dropped.
    pub fn write(&self, entry: LogEntry) {
        let _ = self.0.send(entry);
    }
}

/// Detects the beginning and the end of a current.
///
/// A run crosses zero current often. So while the power stage is enabled, the current counts as ended only after it has been
/// zero for [`CurrentMonitor::OFF_NS`].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct CurrentMonitor {
    is_on: bool,
    zero_since_ns: Option<u64>,
}

/// A change that a [`CurrentMonitor`] has detected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum CurrentChange {
    On,
    Off { since_s: f64 },
}

impl CurrentMonitor {
    const OFF_NS: u64 = 250_000_000;

    /// Takes the current at `now_ns`; returns a change.
    pub(super) fn update(
        &mut self,
        now_ns: u64,
        current_a: f64,
        is_enabled: bool,
    ) -> Option<CurrentChange> {
        if current_a != 0.0 {
            self.zero_since_ns = None;
            let was_on = std::mem::replace(&mut self.is_on, true);
            return (!was_on).then_some(CurrentChange::On);
        }
        let since_ns = *self.zero_since_ns.get_or_insert(now_ns);
        let has_lasted = now_ns.saturating_sub(since_ns) >= Self::OFF_NS;
        if !self.is_on || (is_enabled && !has_lasted) {
            return None;
        }
        self.is_on = false;
        let since_s = seconds(since_ns);
        Some(CurrentChange::Off { since_s })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_current_ends_when_disabled_or_when_zero_for_a_quarter_of_a_second() {
        let mut monitor = CurrentMonitor::default();
        let mut update =
            |ms: u64, current_a, is_enabled| monitor.update(ms * 1_000_000, current_a, is_enabled);
        let off = |ms: u64| {
            let since_s = seconds(ms * 1_000_000);
            Some(CurrentChange::Off { since_s })
        };
        assert_eq!(update(0, 0.0, false), None, "off from the start");
        assert_eq!(update(10, 0.5, true), Some(CurrentChange::On));
        assert_eq!(update(11, 0.0, true), None, "a sweep crosses zero");
        assert_eq!(update(12, -0.5, true), None);
        assert_eq!([update(20, 0.0, true), update(269, 0.0, true)], [None; 2]);
        assert_eq!(update(270, 0.0, true), off(20));
        assert_eq!(update(900, 0.0, true), None);
        assert_eq!(update(1000, 0.1, true), Some(CurrentChange::On));
        assert_eq!(update(1001, 0.0, false), off(1001), "at once");
    }
}
