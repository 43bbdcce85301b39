//! Faults of an emulated probe.

use std::collections::VecDeque;

/// A fault of an emulated probe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Fault {
    /// No fault.
    #[default]
    None,
    /// Nothing is sent.
    Silence,
    /// Bytes are corrupted at regular intervals.
    Corrupt {
        /// Distance of the corrupted bytes: 1 corrupts every byte.
        every: u32,
    },
    /// The measured value no longer changes, but is sent as new.
    Stuck,
    /// Measurements jump at regular intervals.
    Jump {
        /// Distance of the jumps: 2 makes every second measurement jump.
        every: u32,
        /// Size of the jump in metres.
        by_m: f64,
    },
    /// The target is far outside the measuring range.
    OutOfRange,
    /// Everything is sent with a delay.
    Late {
        /// The delay in nanoseconds.
        by_ns: u64,
    },
    /// The probe restarts now: its counter starts again, and an unfinished message is cut off.
    Reset,
}

/// Applies a fault to the measurements and to the bytes of an emulated probe.
#[derive(Debug, Default)]
pub(super) struct FaultInjector {
    fault: Fault,
    stuck_m: Option<f64>,
    measurements: u32,
    bytes: u32,
    random: u32,
    delayed: VecDeque<(u64, Vec<u8>)>,
}

impl FaultInjector {
    /// Sets a new fault; bytes that the previous fault delayed are lost.
    pub(super) fn set(&mut self, fault: Fault) {
        *self = Self {
            fault,
            random: self.random,
            ..Self::default()
        };
    }

    /// The measured position for the true position `position_m`, with the active fault applied.
    pub(super) fn measure(&mut self, position_m: f64, out_of_range_m: f64) -> f64 {
        self.measurements = self.measurements.wrapping_add(1);
        match self.fault {
            Fault::Stuck => *self.stuck_m.get_or_insert(position_m),
            Fault::Jump { every, by_m } if self.measurements.is_multiple_of(every.max(1)) => {
                position_m + by_m
            }
            Fault::OutOfRange => out_of_range_m,
            _ => position_m,
        }
    }

    /// The bytes that go out now: `bytes` with the fault applied, and delayed bytes that are due.
    pub(super) fn send(&mut self, mut bytes: Vec<u8>, now_ns: u64) -> Vec<u8> {
        match self.fault {
            Fault::Silence => bytes.clear(),
            Fault::Corrupt { every } => self.corrupt(&mut bytes, every.max(1)),
            Fault::Late { by_ns } => return self.delay(bytes, now_ns, by_ns),
            _ => {}
        }
        bytes
    }

    fn corrupt(&mut self, bytes: &mut [u8], every: u32) {
        for byte in bytes {
            self.bytes = self.bytes.wrapping_add(1);
            if self.bytes.is_multiple_of(every) {
                // Linear congruential generator of Numerical Recipes.
                self.random = self
                    .random
                    .wrapping_mul(1_664_525)
                    .wrapping_add(1_013_904_223);
                *byte ^= (self.random >> 24) as u8 | 1; // bit 0 set: the byte always changes
            }
        }
    }

    fn delay(&mut self, bytes: Vec<u8>, now_ns: u64, by_ns: u64) -> Vec<u8> {
        if !bytes.is_empty() {
            self.delayed.push_back((now_ns + by_ns, bytes));
        }
        let mut due = Vec::new();
        while let Some((_, bytes)) = self.delayed.pop_front_if(|(due_ns, _)| *due_ns <= now_ns) {
            due.extend(bytes);
        }
        due
    }
}
