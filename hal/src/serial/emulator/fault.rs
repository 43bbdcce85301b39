//! Faults that a pretend probe can be asked for.

use std::collections::VecDeque;

/// How a pretend probe misbehaves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Fault {
    /// Not at all.
    #[default]
    None,
    /// It sends nothing.
    Silence,
    /// One byte in so many is another byte.
    Corrupt {
        /// Bytes from one damaged one to the next.
        every: u32,
    },
    /// Its measurements stay where the stage is now, and are sent as new.
    Stuck,
    /// One measurement in so many lies elsewhere.
    Jump {
        /// Measurements from one jump to the next.
        every: u32,
        /// How far, metres.
        by_m: f64,
    },
    /// The target is twice the range beyond its end.
    OutOfRange,
    /// All it sends leaves it later.
    Late {
        /// By how much, nanoseconds.
        by_ns: u64,
    },
    /// It restarts at once: its counter begins again, what it had to send is cut off.
    Reset,
}

/// Carries out a fault on what a probe measures and on what it sends.
#[derive(Debug, Default)]
pub(super) struct Ailing {
    fault: Fault,
    stuck_m: Option<f64>,
    measurements: u32,
    bytes: u32,
    noise: u32,
    held_back: VecDeque<(u64, Vec<u8>)>,
}

impl Ailing {
    /// A new fault; what a former one held back is lost.
    pub(super) fn ask(&mut self, fault: Fault) {
        *self = Self {
            fault,
            noise: self.noise,
            ..Self::default()
        };
    }

    /// What is measured at `position_m` with `beyond_m` a place out of range.
    pub(super) fn measure(&mut self, position_m: f64, beyond_m: f64) -> f64 {
        self.measurements = self.measurements.wrapping_add(1);
        match self.fault {
            Fault::Stuck => *self.stuck_m.get_or_insert(position_m),
            Fault::Jump { every, by_m } if self.measurements.is_multiple_of(every.max(1)) => {
                position_m + by_m
            }
            Fault::OutOfRange => beyond_m,
            _ => position_m,
        }
    }

    /// What goes out on the line now of `bytes` and of what was held back before.
    pub(super) fn send(&mut self, mut bytes: Vec<u8>, now_ns: u64) -> Vec<u8> {
        match self.fault {
            Fault::Silence => bytes.clear(),
            Fault::Corrupt { every } => bytes
                .iter_mut()
                .for_each(|byte| self.corrupt(byte, every.max(1))),
            Fault::Late { by_ns } => return self.hold_back(bytes, now_ns, by_ns),
            _ => {}
        }
        bytes
    }

    fn corrupt(&mut self, byte: &mut u8, every: u32) {
        self.bytes = self.bytes.wrapping_add(1);
        if self.bytes.is_multiple_of(every) {
            self.noise = self
                .noise
                .wrapping_mul(1_664_525)
                .wrapping_add(1_013_904_223); // Numerical Recipes
            *byte ^= (self.noise >> 24) as u8 | 1; // never the same byte
        }
    }

    fn hold_back(&mut self, bytes: Vec<u8>, now_ns: u64, by_ns: u64) -> Vec<u8> {
        if !bytes.is_empty() {
            self.held_back.push_back((now_ns + by_ns, bytes));
        }
        let mut due = Vec::new();
        while let Some((_, bytes)) = self.held_back.pop_front_if(|(due_ns, _)| *due_ns <= now_ns) {
            due.extend(bytes);
        }
        due
    }
}
