//! What happens to acting devices, as it happens: for people, and for scripts that assert on it.

use std::fmt;
use std::sync::mpsc::{Receiver, Sender, channel};

use serde::Serialize;

use super::stage::seconds;

/// A change.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Entry {
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

impl fmt::Display for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Entry { time_s, device, what, text, current_a, position_m, .. } = self;
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
pub struct Journal(Sender<Entry>);

impl Journal {
    /// A journal and where it is read.
    pub fn new() -> (Journal, Receiver<Entry>) {
        let (sender, receiver) = channel();
        (Journal(sender), receiver)
    }

    /// Writes; if nobody reads any more, nobody misses it.
    pub fn write(&self, entry: Entry) {
        let _ = self.0.send(entry);
    }
}

/// Current on and off: zero counts as off only after a while, for a sweep passes through zero all the time.
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
    /// So long a current must be zero to be off.
    const OFF_NS: u64 = 20_000_000;

    pub(super) fn see(&mut self, now_ns: u64, current_a: f64) -> Option<Turned> {
        if current_a != 0.0 {
            self.zero_since_ns = None;
            return (!std::mem::replace(&mut self.is_on, true)).then_some(Turned::On);
        }
        let since_ns = *self.zero_since_ns.get_or_insert(now_ns);
        let is_over = self.is_on && now_ns.saturating_sub(since_ns) >= Self::OFF_NS;
        self.is_on &= !is_over;
        is_over.then_some(Turned::Off { since_s: seconds(since_ns) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_current_is_off_when_it_has_been_zero_for_a_while_and_since_it_became_zero() {
        let mut watch = CurrentWatch::default();
        let ms = |ms: u64| ms * 1_000_000;
        assert_eq!(watch.see(ms(0), 0.0), None, "off from the start is no news");
        assert_eq!(watch.see(ms(10), 0.5), Some(Turned::On));
        assert_eq!(watch.see(ms(11), 0.0), None, "a sweep passes through zero");
        assert_eq!(watch.see(ms(12), -0.5), None);
        assert_eq!([20, 39].map(|at| watch.see(ms(at), 0.0)), [None; 2]);
        assert_eq!(watch.see(ms(40), 0.0), Some(Turned::Off { since_s: 0.02 }));
        assert_eq!(watch.see(ms(80), 0.0), None);
    }
}
