//! The messages of the loop in the encoding of a recording, for viewers that follow the loop.

use prost::Message;

use super::Topic;
use super::continuity::Continuity;
use super::log_time::LogTime;
use super::messages;
use super::timing::Tally;
use bench_rt::clock::scheduled_ns;
use bench_rt::record::{Event, EventKind, LoopMessage, TickRecord};

/// An encoded message.
#[derive(Clone, Debug, PartialEq)]
pub struct EncodedMessage {
    /// Its channel.
    pub topic: Topic,
    /// The scheduled time of its tick in nanoseconds since 1970.
    pub log_ns: u64,
    /// The message as protobuf.
    pub bytes: Vec<u8>,
}

/// Encodes one run, or the loop between two runs, with the same messages and log times as its recording.
pub struct LiveEncoder {
    period_s: f64,
    log_time: LogTime,
    account: Continuity,
    tally: Tally,
}

impl LiveEncoder {
    /// An encoder of a loop that started at `started_ns` since 1970.
    pub fn new(period_s: f64, started_ns: u64) -> LiveEncoder {
        LiveEncoder {
            period_s,
            log_time: LogTime::new(started_ns),
            account: Continuity::default(),
            tally: Tally::new(scheduled_ns(1, period_s)),
        }
    }

    /// The messages of a recording that follow from a message of the loop.
    pub fn encode(&mut self, message: &LoopMessage) -> Vec<EncodedMessage> {
        match message {
            LoopMessage::Tick(tick) => self.tick(tick),
            LoopMessage::Event(event) => vec![self.event(event)],
        }
    }

    /// The summary of the last second, after the last message of the loop.
    pub fn finish(&mut self) -> Option<EncodedMessage> {
        let (last_ns, timing) = self.tally.close(&self.account)?;
        Some(self.message(Topic::Timing, last_ns, &timing))
    }

    fn tick(&mut self, tick: &TickRecord) -> Vec<EncodedMessage> {
        let mut encoded = Vec::new();
        if self.tally.is_over(tick) {
            encoded.extend(self.finish());
        }
        // A loop that counts anew is shown all the same: the recorder refuses it, a viewer does not.
        let _ = self.account.tick(tick);
        self.tally.add(tick);
        encoded.push(self.message(Topic::Loop, tick.scheduled_ns, &messages::Loop::from(tick)));
        encoded
    }

    fn event(&mut self, event: &Event) -> EncodedMessage {
        self.account.event(event);
        if let EventKind::Clock(times) = &event.kind {
            self.log_time.follow(times);
        }
        let loop_ns = scheduled_ns(event.tick, self.period_s);
        self.message(Topic::Event, loop_ns, &messages::Event::from(event))
    }

    fn message(&self, topic: Topic, loop_ns: u64, message: &impl Message) -> EncodedMessage {
        EncodedMessage {
            topic,
            log_ns: self.log_time.at(loop_ns),
            bytes: message.encode_to_vec(),
        }
    }
}
