//! The loop's end of the ring to the recorder. It never blocks: messages that do not fit are counted, and the count is
//! published as soon as there is room again.

use rtrb::Producer;

use super::record::{Event, EventKind, LoopMessage, REQUESTS_PER_TICK, TickRecord};

/// Publishes records and events without waiting.
pub struct Publisher {
    ring: Producer<LoopMessage>,
    lost: u64,
    unreported: u64,
}

/// Slots that a tick can need at most: three events per request (an arm request whose amplifier does not enable makes
/// four, but needs a clear request before the next one, which makes two), a trip and its state, the end of the
/// program and its state, the record, and the count of lost records.
pub const SLOTS_PER_TICK: usize = 3 * REQUESTS_PER_TICK + 6;

impl Publisher {
    /// A publisher into `ring`.
    pub fn new(ring: Producer<LoopMessage>) -> Self {
        Publisher {
            ring,
            lost: 0,
            unreported: 0,
        }
    }

    /// Whether there is room for everything that a tick may publish.
    pub fn has_room(&self) -> bool {
        self.ring.slots() >= SLOTS_PER_TICK
    }

    /// Whether the recorder is gone for good.
    pub fn is_abandoned(&self) -> bool {
        self.ring.is_abandoned()
    }

    /// Number of records that did not fit.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Publishes the signals of a tick. Runs in the tick: must not allocate or block.
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

    /// Publishes a change. Runs in the tick: must not allocate or block.
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
    fn counts_lost_records_and_reports_them_when_there_is_room() {
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
