//! Streams the ticks and events of a recording, a chunk at a time.

use std::path::{Path, PathBuf};

use prost::Message;

use super::contents::Part;
use super::messages;
use super::walk::{Stop, Walk};
use super::{RecordingError, Topic};
use crate::rt::record::{Event, LoopMessage, TickRecord};

/// Ticks and events of a recording, read on demand.
pub(super) struct Stream {
    path: PathBuf,
    walk: Walk,
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
    /// A stream of the first `left` ticks and events of the file under `walk`.
    pub(super) fn new(path: &Path, walk: Walk, left: u64) -> Stream {
        Stream {
            path: path.into(),
            walk,
            chunk: Vec::new(),
            next: 0,
            left,
        }
    }

    /// Reads the next chunk. An error after some good records occurs again at the next call, if more records are needed.
    fn read_chunk(&mut self) -> Result<(), RecordingError> {
        self.chunk.clear();
        self.next = 0;
        let chunk = &mut self.chunk;
        let stepped = self.walk.step(&mut |part| match part {
            Part::Message {
                topic: topic @ (Topic::Loop | Topic::Event),
                data,
            } => published(topic, data).map(|p| chunk.push(p)),
            _ => Ok(()),
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
            at_byte: self.walk.offset,
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

/// The record of the loop in a message on `/loop` or `/event`.
pub(super) fn published(topic: Topic, data: &[u8]) -> Result<LoopMessage, String> {
    if topic == Topic::Loop {
        let message: messages::Loop = decode(data)?;
        return TickRecord::try_from(&message)
            .map(LoopMessage::Tick)
            .map_err(|e| e.to_string());
    }
    let message: messages::Event = decode(data)?;
    Event::try_from(&message)
        .map(LoopMessage::Event)
        .map_err(|e| e.to_string())
}

/// Decodes a message.
pub(super) fn decode<M: Message + Default>(data: &[u8]) -> Result<M, String> {
    M::decode(data).map_err(|e| e.to_string())
}
