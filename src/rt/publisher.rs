//! The loop's end of the ring to the recorder. It never blocks: what does not fit is counted, and the count is published as
//! soon as there is room again.

use rtrb::Producer;

use super::record::{Event, EventKind, LoopMessage, TickRecord};
use super::servo::REQUESTS_PER_TICK;

/// Publishes records and events without waiting.
pub struct Publisher {
    ring: Producer<LoopMessage>,
    lost: u64,
    unreported: u64,
}

/// Free slots that a tick can need: three events an order (arm requests whose amplifier does not enable make four, but each
/// needs a clear order before the next, which makes two), a trip and its state, the program's end and its state, the record,
/// and the count of what was lost.
pub const SLOTS_PER_TICK: usize = 3 * REQUESTS_PER_TICK + 6;

impl Publisher {
    /// An publisher into `ring`.
    pub fn new(ring: Producer<LoopMessage>) -> Self {
        Publisher {
            ring,
            lost: 0,
            unreported: 0,
        }
    }

    /// Whether all that a tick may publish fits.
    pub fn has_room(&self) -> bool {
        self.ring.slots() >= SLOTS_PER_TICK
    }

    /// Whether the recorder is gone for good.
    pub fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }

    /// Records that did not fit, all in all.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// The signals of a tick. *In the tick.*
    pub fn record(&mut self, record: TickRecord) {
        if self.unreported > 0 && self.ring.slots() >= 2 {
            let lost = Event {
                tick: record.tick,
                kind: EventKind::Lost {
                    records: self.unreported,
                },
            };
            self.unreported = 0;
            self.push(LoopMessage::Event(lost));
        }
        self.push(LoopMessage::Tick(record));
    }

    /// A change. *In the tick.*
    pub fn event(&mut self, tick: u64, kind: EventKind) {
        self.push(LoopMessage::Event(Event { tick, kind }));
    }

    fn push(&mut self, published: LoopMessage) {
        if self.ring.push(published).is_err() {
            self.lost += 1;
            self.unreported += 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rtrb::RingBuffer;

    #[test]
    fn what_does_not_fit_is_counted_and_told_when_there_is_room_again() {
        let (producer, mut consumer) = RingBuffer::new(4);
        let mut publisher = Publisher::new(producer);
        let record = |tick| TickRecord {
            tick,
            ..TickRecord::default()
        };
        (0..7).for_each(|tick| publisher.record(record(tick)));
        assert_eq!(publisher.lost(), 3, "ticks 4, 5 and 6 found no room");
        for expected in 0..4 {
            assert!(matches!(consumer.pop(), Ok(LoopMessage::Tick(t)) if t.tick == expected));
        }
        publisher.record(record(7));
        let lost = consumer.pop();
        assert!(
            matches!(
                lost,
                Ok(LoopMessage::Event(Event {
                    tick: 7,
                    kind: EventKind::Lost { records: 3 }
                }))
            ),
            "{lost:?}"
        );
        assert!(matches!(consumer.pop(), Ok(LoopMessage::Tick(t)) if t.tick == 7));
    }
}
