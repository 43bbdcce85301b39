//! A pretend optoNCDT: sends every measurement by itself.

use super::fault::{Ailing, Fault};
use super::{EmulatedProbe, Sampler};
use crate::serial::optoncdt::{Settings, message};

/// The device's side of [`crate::serial::optoncdt`].
#[derive(Debug)]
pub struct OptoncdtDevice {
    settings: Settings,
    sampler: Sampler,
    ailing: Ailing,
    /// The next message is cut off: the probe has restarted in the middle of it.
    cut: bool,
}

impl OptoncdtDevice {
    /// A probe just switched on.
    pub fn new(settings: Settings, rate_hz: f64) -> Self {
        Self {
            settings,
            sampler: Sampler::new(rate_hz),
            ailing: Ailing::default(),
            cut: false,
        }
    }

    /// One cycle; the values that are not the displacement are zero.
    fn cycle(&mut self, position_m: f64) -> Vec<u8> {
        let measured_m = self.ailing.measure(position_m, 2.0 * self.settings.range_m);
        let displacement = self.settings.cycle.displacement;
        let value = |place| {
            if place == displacement {
                self.settings.counts(measured_m)
            } else {
                0
            }
        };
        let bytes =
            (0..self.settings.cycle.values).flat_map(|place| message(value(place), place == 0));
        let kept = if std::mem::take(&mut self.cut) {
            2
        } else {
            usize::MAX
        };
        bytes.take(kept).collect()
    }
}

impl EmulatedProbe for OptoncdtDevice {
    fn handle(&mut self, _bytes: &[u8], now_ns: u64, position_m: f64) -> Vec<u8> {
        self.poll(now_ns, position_m)
    }

    fn poll(&mut self, now_ns: u64, position_m: f64) -> Vec<u8> {
        let due = self.sampler.due(now_ns);
        let bytes = (0..due).flat_map(|_| self.cycle(position_m)).collect();
        self.ailing.send(bytes, now_ns)
    }

    fn due_ns(&self) -> Option<u64> {
        self.sampler.next_ns
    }

    fn inject_fault(&mut self, fault: Fault) {
        self.cut |= fault == Fault::Reset;
        self.ailing.ask(fault);
    }
}
