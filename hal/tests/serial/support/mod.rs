//! Shared code of the tests of the serial probes.

pub mod naive;
pub mod probes;
pub mod rehearsal;

use bench_hal::serial::{Decoder, Event};

/// The events of `bytes`, fed in one piece.
pub fn events(decoder: &mut dyn Decoder, bytes: &[u8]) -> Vec<Event> {
    let mut events = Vec::new();
    decoder.feed(bytes, &mut |event| events.push(event));
    events
}

/// Raw counts of the valid values among `events`.
pub fn valid(events: &[Event]) -> Vec<i64> {
    events
        .iter()
        .filter_map(|event| {
            if let Event::Value(sample) = event {
                Some(sample.raw)
            } else {
                None
            }
        })
        .collect()
}

/// Number of bytes that were reported as damaged.
pub fn damaged(events: &[Event]) -> u64 {
    events
        .iter()
        .map(|event| {
            if let Event::Damaged(bytes) = event {
                u64::from(*bytes)
            } else {
                0
            }
        })
        .sum()
}

/// A generator of repeatable noise (xorshift64*).
pub struct Noise(pub u64);

impl Noise {
    pub fn byte(&mut self) -> u8 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 56) as u8
    }

    pub fn bytes(&mut self, count: usize) -> Vec<u8> {
        (0..count).map(|_| self.byte()).collect()
    }
}
