//! A probe that measures at a fixed rate and answers by its protocol.

use super::fault::{Fault, FaultInjector};
use super::responder::Responder;
use crate::serial::error::{SerialError, positive};
use crate::serial::protocol::Protocol;

/// An emulated probe: measures at a fixed rate, answers by its protocol, and shows injected faults.
///
/// A slow caller does not reduce the rate: each call takes all measurements that became due since the previous call, at
/// the given position.
///
/// ```
/// use bench_hal::serial::emulator::EmulatedProbe;
/// use bench_hal::serial::optoncdt;
///
/// let mut probe = EmulatedProbe::new(&optoncdt::Settings::new(1e-3), 1000.0).unwrap();
/// assert_eq!(probe.poll(0, 0.5e-3).len(), 3); // one measurement of three bytes
/// assert_eq!(probe.poll(2_000_000, 0.5e-3).len(), 6); // two more after 2 ms
/// ```
pub struct EmulatedProbe {
    responder: Box<dyn Responder>,
    sampler: Sampler,
    faults: FaultInjector,
}

impl EmulatedProbe {
    /// A probe of `protocol` that takes `rate_hz` measurements per second. Refuses invalid settings.
    pub fn new(protocol: &dyn Protocol, rate_hz: f64) -> Result<Self, SerialError> {
        positive("rate_hz", rate_hz)?;
        protocol.decoder()?; // checks the settings
        Ok(Self {
            responder: protocol.responder()?,
            sampler: Sampler::new(rate_hz),
            faults: FaultInjector::default(),
        })
    }

    /// Receives bytes from the host; returns what the probe sends now.
    pub fn handle(&mut self, bytes: &[u8], now_ns: u64, position_m: f64) -> Vec<u8> {
        let mut sent = self.measure(now_ns, position_m);
        for byte in bytes {
            sent.extend(self.responder.receive(*byte));
        }
        self.faults.send(sent, now_ns)
    }

    /// Advances the time; returns what the probe sends without a request, and delayed bytes that are due.
    pub fn poll(&mut self, now_ns: u64, position_m: f64) -> Vec<u8> {
        self.handle(&[], now_ns, position_m)
    }

    /// When the next measurement is due; `None` before the first call of [`poll`](Self::poll) or
    /// [`handle`](Self::handle).
    pub fn due_ns(&self) -> Option<u64> {
        self.sampler.next_ns
    }

    /// Injects a fault, which replaces the previous one. [`Fault::Reset`] acts once.
    pub fn inject_fault(&mut self, fault: Fault) {
        if fault == Fault::Reset {
            self.responder.restart();
        }
        self.faults.set(fault);
    }

    fn measure(&mut self, now_ns: u64, position_m: f64) -> Vec<u8> {
        let mut sent = Vec::new();
        for _ in 0..self.sampler.due(now_ns) {
            let out_of_range_m = self.responder.out_of_range_m();
            let measured_m = self.faults.measure(position_m, out_of_range_m);
            sent.extend(self.responder.measure(measured_m));
        }
        sent
    }
}

/// Computes how many measurements are due.
#[derive(Debug)]
struct Sampler {
    period_ns: u64,
    next_ns: Option<u64>,
}

impl Sampler {
    /// Upper limit of measurements per call, for a caller that was suspended.
    const MAX_AT_ONCE: u64 = 10_000;

    fn new(rate_hz: f64) -> Self {
        Self {
            period_ns: ((1e9 / rate_hz) as u64).max(1),
            next_ns: None,
        }
    }

    /// Number of measurements that became due up to `now_ns`; the first is due at the first call.
    fn due(&mut self, now_ns: u64) -> u64 {
        let next_ns = *self.next_ns.get_or_insert(now_ns);
        let Some(late_ns) = now_ns.checked_sub(next_ns) else {
            return 0;
        };
        let count = late_ns / self.period_ns + 1;
        self.next_ns = Some(next_ns + count * self.period_ns);
        count.min(Self::MAX_AT_ONCE)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sampling_rate_does_not_depend_on_how_often_the_sampler_is_called() {
        let mut often = Sampler::new(1000.0);
        let mut rarely = Sampler::new(1000.0);
        let counted: u64 = (0..=10_000).map(|step| often.due(step * 100_000)).sum();
        assert_eq!(
            [counted, rarely.due(0) + rarely.due(1_000_000_000)],
            [1001; 2]
        );
    }
}
