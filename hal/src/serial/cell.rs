//! Passes the newest measurement from one writer to one reader, wait-free on both sides.
//!
//! There are three slots: one belongs to the writer, one to the reader, and one waits between them. Publishing and taking
//! are one atomic exchange each. Neither side waits for the other, even if the other thread is suspended. (With a sequence
//! lock a real-time reader would spin without end on a writer that it has preempted.)
//!
//! ```text
//! writer: fill own slot, exchange own <-> waiting | NEW     (release: the words are in the slot before it is handed over)
//! reader: if waiting is NEW, exchange own <-> waiting       (acquire: the words are read after it was taken over)
//! ```

use std::sync::Arc;

use crate::Validity;
use crate::atomics::{AtomicU8, AtomicU64, Ordering};

/// The measurement that the reader thread passes to the loop.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Measurement {
    pub position_m: f64,
    pub sequence: u64,
    /// Time of the measurement on the clock of the probe.
    pub measured_ns: u64,
    pub validity: Validity,
}

const NEW: u8 = 4;
const SLOT: u8 = 3;

type Slot = [AtomicU64; 4];

struct Shared {
    slots: [Slot; 3],
    /// Number of the waiting slot, with the flag `NEW` if the reader has not taken it yet.
    waiting: AtomicU8,
}

/// The side that publishes measurements.
pub(super) struct Writer {
    shared: Arc<Shared>,
    own: u8,
}

/// The side that takes the newest measurement.
pub(super) struct Reader {
    shared: Arc<Shared>,
    own: u8,
}

/// A cell with a `Missing` measurement.
pub(super) fn cell() -> (Writer, Reader) {
    let slots = std::array::from_fn(|_| words(Measurement::default()).map(AtomicU64::new));
    let shared = Arc::new(Shared {
        slots,
        waiting: AtomicU8::new(1),
    });
    (
        Writer {
            shared: shared.clone(),
            own: 0,
        },
        Reader { shared, own: 2 },
    )
}

impl Writer {
    pub(super) fn publish(&mut self, measurement: Measurement) {
        let slot = &self.shared.slots[usize::from(self.own)];
        slot.iter()
            .zip(words(measurement))
            .for_each(|(word, value)| word.store(value, Ordering::Relaxed));
        self.own = self.shared.waiting.swap(self.own | NEW, Ordering::AcqRel) & SLOT;
    }
}

impl Reader {
    pub(super) fn newest(&mut self) -> Measurement {
        if self.shared.waiting.load(Ordering::Relaxed) & NEW != 0 {
            self.own = self.shared.waiting.swap(self.own, Ordering::AcqRel) & SLOT;
        }
        let slot = &self.shared.slots[usize::from(self.own)];
        measurement(std::array::from_fn(|word| {
            slot[word].load(Ordering::Relaxed)
        }))
    }
}

fn words(measurement: Measurement) -> [u64; 4] {
    let Measurement {
        position_m,
        sequence,
        measured_ns,
        validity,
    } = measurement;
    [position_m.to_bits(), sequence, measured_ns, validity as u64]
}

fn measurement([position, sequence, measured_ns, validity]: [u64; 4]) -> Measurement {
    let validity = match validity {
        0 => Validity::Valid,
        1 => Validity::OutOfRange,
        2 => Validity::Faulty,
        _ => Validity::Missing,
    };
    Measurement {
        position_m: f64::from_bits(position),
        sequence,
        measured_ns,
        validity,
    }
}

#[cfg(all(test, loom))]
mod interleavings {
    use loom::thread;

    use super::*;

    fn consistent(sequence: u64) -> Measurement {
        Measurement {
            position_m: sequence as f64,
            sequence,
            measured_ns: sequence,
            validity: Validity::Valid,
        }
    }

    /// Each reading is one that was published, as a whole, and no reading is older than the one before.
    #[test]
    fn readings_are_whole_and_in_order() {
        loom::model(|| {
            let (mut writer, mut reader) = cell();
            writer.publish(consistent(1));
            let publishing = thread::spawn(move || {
                (2..=3).for_each(|sequence| writer.publish(consistent(sequence)));
            });
            let mut before = 0;
            for _ in 0..2 {
                let taken = reader.newest();
                assert_eq!(taken, consistent(taken.sequence), "torn");
                assert!(
                    taken.sequence >= before,
                    "{} after {before}",
                    taken.sequence
                );
                before = taken.sequence;
            }
            publishing.join().unwrap();
            assert_eq!(reader.newest(), consistent(3), "the newest was lost");
        });
    }
}

#[cfg(all(test, not(loom)))]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;

    /// A measurement whose every word follows from its sequence number.
    fn consistent(sequence: u64) -> Measurement {
        let validity = [
            Validity::Valid,
            Validity::OutOfRange,
            Validity::Faulty,
            Validity::Missing,
        ][sequence as usize % 4];
        Measurement {
            position_m: sequence as f64 * 0.5,
            sequence,
            measured_ns: !sequence,
            validity,
        }
    }

    #[test]
    fn measurement_is_missing_before_the_first_value() {
        assert_eq!(
            cell().1.newest(),
            Measurement {
                validity: Validity::Missing,
                ..Measurement::default()
            }
        );
    }

    #[test]
    fn newest_measurement_stays_until_a_newer_one_is_published() {
        let (mut writer, mut reader) = cell();
        (1..=5).for_each(|sequence| writer.publish(consistent(sequence)));
        assert_eq!([reader.newest(), reader.newest()], [consistent(5); 2]);
        writer.publish(consistent(6));
        assert_eq!(reader.newest(), consistent(6));
    }

    #[test]
    fn concurrent_readings_are_consistent_and_in_order() {
        // The writer goes on until the reader has seen enough, however the two share the processors.
        const LAST: u64 = 2_000_000;
        const CHANGES: u64 = 100;
        let (mut writer, mut reader) = cell();
        writer.publish(consistent(0));
        let is_enough = Arc::new(AtomicBool::new(false));
        let ends = Arc::clone(&is_enough);
        let publishing = std::thread::spawn(move || {
            let sequences = (1..).take_while(|_| !ends.load(Ordering::Relaxed));
            sequences.for_each(|sequence| writer.publish(consistent(sequence)));
        });
        let (mut before, mut changes) = (0, 0);
        while before < LAST || changes < CHANGES {
            let taken = reader.newest();
            assert_eq!(taken, consistent(taken.sequence), "torn");
            assert!(
                taken.sequence >= before,
                "{} after {before}",
                taken.sequence
            );
            changes += u64::from(taken.sequence != before);
            before = taken.sequence;
        }
        is_enough.store(true, Ordering::Relaxed);
        publishing.join().unwrap();
    }
}
