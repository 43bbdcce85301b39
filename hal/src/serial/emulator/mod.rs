//! Pretend probes: the device's side of each protocol, to rehearse without hardware and to test.
//!
//! The probes know no clock and no port either: whoever carries the bytes calls [`EmulatedProbe::handle`] with what the
//! host sent and [`EmulatedProbe::poll`] often, with the time and the true position of the stage, and sends what they
//! return. [`ProbeTask`] does so in a thread, on a [`Line`]: a pseudo terminal or a port.
//!
//! Positions are those of the probe: metres from the start of its range (capaNCDT, optoNCDT) or from its zero (ASCII).
//!
//! A slow caller does not slow the probe down: `poll` makes all measurements that fell due since it was called last, of
//! the position it is given.

mod ascii;
mod capancdt;
mod fault;
mod line;
mod optoncdt;
mod task;

pub use self::ascii::AsciiDevice;
pub use self::capancdt::CapancdtDevice;
pub use self::fault::Fault;
pub use self::line::Line;
pub use self::optoncdt::OptoncdtDevice;
pub use self::task::{LineCounts, ProbeTask, SharedProbe};

use super::{Protocol, SerialError};

/// The device's side of a probe.
pub trait EmulatedProbe: Send {
    /// Takes what the host sent; returns what the probe sends at once.
    fn handle(&mut self, bytes: &[u8], now_ns: u64, position_m: f64) -> Vec<u8>;

    /// Lets time pass; returns what the probe sends by itself, or has held back.
    fn poll(&mut self, now_ns: u64, position_m: f64) -> Vec<u8>;

    /// When the next measurement falls due; `None` before the first call of `poll` or `handle`.
    fn due_ns(&self) -> Option<u64>;

    /// Makes the probe misbehave until another fault is asked for. [`Fault::Reset`] happens once.
    fn inject_fault(&mut self, fault: Fault);
}

/// The device's side of `protocol`, making `rate_hz` measurements a second.
pub fn simulate(protocol: &Protocol, rate_hz: f64) -> Result<Box<dyn EmulatedProbe>, SerialError> {
    super::error::positive("rate_hz", rate_hz)?;
    protocol.decoder()?; // refuses settings that make no sense
    Ok(match protocol.clone() {
        Protocol::Capancdt(settings) => Box::new(CapancdtDevice::new(settings, rate_hz)),
        Protocol::Optoncdt(settings) => Box::new(OptoncdtDevice::new(settings, rate_hz)),
        Protocol::Ascii(settings) => Box::new(AsciiDevice::new(
            super::ascii::Writing::new(settings)?,
            rate_hz,
        )),
    })
}

/// When measurements fall due.
#[derive(Debug)]
struct Sampler {
    period_ns: u64,
    next_ns: Option<u64>,
}

impl Sampler {
    /// More than this many due at once are not made: the probe was stopped, not busy.
    const MOST: u64 = 10_000;

    fn new(rate_hz: f64) -> Self {
        Self {
            period_ns: ((1e9 / rate_hz) as u64).max(1),
            next_ns: None,
        }
    }

    /// How many measurements fell due up to `now_ns`; the first at the first call.
    fn due(&mut self, now_ns: u64) -> u64 {
        let next_ns = *self.next_ns.get_or_insert(now_ns);
        let Some(late_ns) = now_ns.checked_sub(next_ns) else {
            return 0;
        };
        let count = late_ns / self.period_ns + 1;
        self.next_ns = Some(next_ns + count * self.period_ns);
        count.min(Self::MOST)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sampler_makes_its_rate_however_rarely_it_is_asked() {
        let mut often = Sampler::new(1000.0);
        let mut rarely = Sampler::new(1000.0);
        let counted: u64 = (0..=10_000).map(|step| often.due(step * 100_000)).sum();
        assert_eq!(
            [counted, rarely.due(0) + rarely.due(1_000_000_000)],
            [1001; 2]
        );
    }
}
