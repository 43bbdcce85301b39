//! Streams the ticks and events of a recording, a chunk at a time.

use std::path::{Path, PathBuf};

use prost::Message;

use super::contents::{Part, Take};
use super::continuity::{Continuity, Gap};
use super::messages;
use super::scanner::Scanner;
use super::walk::{Stop, Walk};
use super::{RecordingError, Topic};
use bench_rt::record::{Event, EventKind, LoopMessage, TickRecord};

/// A reader of the records of a file.
pub(super) enum RecordReader {
    /// Of an undamaged file.
    Walk(Box<Walk>),
    /// Of a damaged file.
    Scanner(Box<Scanner>),
}

impl RecordReader {
    fn step(&mut self, take: &mut Take) -> Result<bool, Stop> {
        match self {
            RecordReader::Walk(walk) => walk.step(take),
            RecordReader::Scanner(scanner) => scanner.step(take).map_err(Stop::Read),
        }
    }

    fn offset(&self) -> u64 {
        match self {
            RecordReader::Walk(walk) => walk.offset,
            RecordReader::Scanner(scanner) => scanner.range.from_byte + scanner.offset,
        }
    }
}

/// Ticks and events of a recording, read on demand.
pub(super) struct Stream {
    path: PathBuf,
    reader: RecordReader,
    decoder: Decoder,
    chunk: Vec<LoopMessage>,
    next: usize,
    /// Number of entries still to be returned, as counted when the file was opened.
    left: u64,
}

impl Iterator for Stream {
    type Item = Result<LoopMessage, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.left = self.left.checked_sub(1)?;
        while self.next == self.chunk.len() {
            if let Err(error) = self.read_chunk() {
                self.left = 0;
                return Some(Err(error));
            }
        }
        self.next += 1;
        Some(Ok(self.chunk[self.next - 1]))
    }
}

impl Stream {
    /// A stream of the first `left` ticks and events of a file.
    pub(super) fn new(path: &Path, reader: RecordReader, left: u64) -> Stream {
        Stream {
            path: path.into(),
            reader,
            decoder: Decoder::default(),
            chunk: Vec::new(),
            next: 0,
            left,
        }
    }

    /// Reads the next chunk. An error after some good records occurs again at the next call, if more records are needed.
    fn read_chunk(&mut self) -> Result<(), RecordingError> {
        self.chunk.clear();
        self.next = 0;
        let (chunk, decoder) = (&mut self.chunk, &mut self.decoder);
        let stepped = self.reader.step(&mut |part| {
            match decoder.decode(&part)? {
                Some(Decoded::Tick(tick, _)) => chunk.push(LoopMessage::Tick(tick)),
                Some(Decoded::Event(event)) => chunk.push(LoopMessage::Event(event)),
                Some(Decoded::Timing(_)) | None => {}
            }
            Ok(())
        });
        match stepped {
            Ok(true) => Ok(()),
            _ if !self.chunk.is_empty() => Ok(()),
            Err(Stop::Read(source)) => Err(RecordingError::Read {
                path: self.path.clone(),
                source,
            }),
            _ => Err(self.changed()),
        }
    }

    fn changed(&self) -> RecordingError {
        RecordingError::Damaged {
            path: self.path.clone(),
            at_byte: self.reader.offset(),
            ticks: 0,
            what: "the file was changed since it was opened".into(),
        }
    }
}

/// The ticks of a recording, see [`super::Recording::ticks`].
pub struct Ticks(Stream);

impl Ticks {
    pub(super) fn of(stream: Stream) -> Ticks {
        Ticks(stream)
    }
}

impl Iterator for Ticks {
    type Item = Result<TickRecord, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.0.next()? {
                Ok(LoopMessage::Tick(tick)) => return Some(Ok(tick)),
                Ok(LoopMessage::Event(_)) => {}
                Err(error) => return Some(Err(error)),
            }
        }
    }
}

/// Decodes the messages of a recording in their order.
#[derive(Debug, Default)]
pub(super) struct Decoder {
    pub(super) account: Continuity,
}

/// A decoded message.
pub(super) enum Decoded {
    Tick(TickRecord, Option<Gap>),
    Event(Event),
    Timing(messages::Timing),
}

impl Decoder {
    /// Decodes a message and counts it; `None` for other parts. Messages on `/loop` and `/event` that are missing are a
    /// [`EventKind::Lost`].
    pub(super) fn decode(&mut self, part: &Part<'_>) -> Result<Option<Decoded>, String> {
        match part {
            Part::Message { topic, data } => self.message(*topic, data).map(Some),
            Part::Missing { topic, messages } => Ok(self.missing(*topic, *messages)),
            Part::Attachment { .. } | Part::Metadata(_) => Ok(None),
        }
    }

    fn message(&mut self, topic: Topic, data: &[u8]) -> Result<Decoded, String> {
        match topic {
            Topic::Loop => self.tick(&decode(data)?),
            Topic::Event => {
                let message: messages::Event = decode(data)?;
                let event = Event::try_from(&message).map_err(|e| e.to_string())?;
                Ok(self.event(event))
            }
            Topic::Timing => decode(data).map(Decoded::Timing),
        }
    }

    fn tick(&mut self, message: &messages::Loop) -> Result<Decoded, String> {
        let tick = TickRecord::try_from(message).map_err(|e| e.to_string())?;
        let refused = |last| format!("tick {} follows tick {last}", tick.tick);
        let gap = self.account.tick(&tick).map_err(|e| refused(e.0))?;
        Ok(Decoded::Tick(tick, gap))
    }

    fn event(&mut self, event: Event) -> Decoded {
        self.account.event(&event);
        Decoded::Event(event)
    }

    fn missing(&mut self, topic: Topic, records: u64) -> Option<Decoded> {
        match topic {
            Topic::Loop | Topic::Event => {
                let tick = self.account.last_tick().unwrap_or_default();
                let kind = EventKind::Lost { records };
                Some(self.event(Event { tick, kind }))
            }
            Topic::Timing => None,
        }
    }
}

fn decode<M: Message + Default>(data: &[u8]) -> Result<M, String> {
    M::decode(data).map_err(|e| e.to_string())
}
