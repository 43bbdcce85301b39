//! The loop's end of the ring to the recorder. It never blocks: messages that do not fit are counted, and the count is
//! published as soon as there is room again.

use rtrb::Producer;

use super::record::{Event, EventKind, LoopMessage, REQUESTS_PER_TICK, TickRecord};

/// Publishes records and events without waiting.
pub struct Publisher {
    ring: Producer<LoopMessage>,
    lost: u64,
    unreported: u64,
    lost_in_a_row: u64,
}

/// Slots that only events may use. Events are few; a trip and what follows it finds room in a ring that is full of records.
pub const EVENT_SLOTS: usize = 64;

/// Slots that a tick can need at most: the clocks, the end of a reset, two events per request, the states armed and running, a
/// trip and its state, the end of the program and its state, the record, and the count of lost records; two signals and an
/// expired arm lease, each with its state.
pub const SLOTS_PER_TICK: usize = 2 * REQUESTS_PER_TICK + 16;

impl Publisher {
    /// A publisher into `ring`.
    pub fn new(ring: Producer<LoopMessage>) -> Self {
        Publisher {
            ring,
            lost: 0,
            unreported: 0,
            lost_in_a_row: 0,
        }
    }

    /// Whether there is room for everything that a tick may publish.
    pub fn has_room(&self) -> bool {
        self.ring.slots() >= SLOTS_PER_TICK + EVENT_SLOTS
    }

    /// Whether the recorder is gone for good.
    pub fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }

    /// Number of records that did not fit.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Number of ticks without a record since the last recorded one.
    pub fn lost_in_a_row(&self) -> u64 {
        self.lost_in_a_row
    }

    /// Publishes the signals of a tick. Runs in the tick: must not allocate or block.
    pub fn record(&mut self, record: TickRecord) {
        let slots = self.ring.slots();
        if self.unreported > 0 && slots >= EVENT_SLOTS + 2 {
            let lost = Event {
                tick: record.tick,
                kind: EventKind::Lost {
                    records: self.unreported,
                },
            };
            self.unreported = 0;
            self.push(LoopMessage::Event(lost));
        }
        self.lost_in_a_row += 1;
        if slots <= EVENT_SLOTS {
            return self.count_lost();
        }
        if self.push(LoopMessage::Tick(record)) {
            self.lost_in_a_row = 0;
        }
    }

    /// Publishes a change. Runs in the tick: must not allocate or block.
    pub fn event(&mut self, tick: u64, kind: EventKind) {
        self.push(LoopMessage::Event(Event { tick, kind }));
    }

    /// Whether there was room.
    fn push(&mut self, published: LoopMessage) -> bool {
        let pushed = self.ring.push(published).is_ok();
        if !pushed {
            self.count_lost();
        }
        pushed
    }

    fn count_lost(&mut self) {
        self.lost += 1;
        self.unreported += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rtrb::RingBuffer;

    #[test]
    fn counts_lost_records_and_reports_them_when_there_is_room() {
        let (producer, mut consumer) = RingBuffer::new(EVENT_SLOTS + 4);
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

    #[test]
    fn full_ring_has_room_for_a_trip() {
        let (producer, mut consumer) = RingBuffer::new(EVENT_SLOTS + 4);
        let mut publisher = Publisher::new(producer);
        (0..100).for_each(|tick| {
            publisher.record(TickRecord {
                tick,
                ..TickRecord::default()
            });
        });
        assert_eq!((publisher.lost(), publisher.lost_in_a_row()), (96, 96));
        (0..EVENT_SLOTS).for_each(|_| publisher.event(100, EventKind::Completed));
        assert_eq!(publisher.lost(), 96, "no event was lost");
        let is_event = |message: &LoopMessage| matches!(message, LoopMessage::Event(_));
        let events = std::iter::from_fn(|| consumer.pop().ok()).filter(is_event);
        assert_eq!(events.count(), EVENT_SLOTS);
    }
}
