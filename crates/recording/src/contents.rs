//! The contents of the records of an MCAP file. Only checked data are returned.
//!
//! Checked are the CRC of the uncompressed content of a chunk *before* its first message, and the CRC of an attachment. For
//! `mcap`, a CRC field of zero means *not checked*; this module refuses it for chunks and attachments. This module also checks
//! that the messages of a channel are numbered without a gap, and some lengths with which `mcap` would panic.

use std::collections::BTreeMap;

use mcap::records::{Channel, Metadata, Record, op};
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{McapError, parse_record};

use super::{METADATA_RECORD, Topic, error};

/// Largest chunk after decompression; its header states how much memory is allocated.
const CHUNK_BYTES: usize = 64 << 20;

/// A checked part of the file.
pub(super) enum Part<'a> {
    Message {
        topic: Topic,
        data: &'a [u8],
    },
    Attachment {
        name: String,
        media_type: String,
        data: &'a [u8],
    },
    Metadata(Metadata),
    /// Messages that the file lacks here. Only of a file that is salvaged.
    Missing {
        topic: Topic,
        messages: u64,
    },
}

/// Receives the parts. An error means that the part is damaged.
pub(super) type Take<'a> = dyn FnMut(Part<'_>) -> Result<(), String> + 'a;

/// The use of the numbers of the messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Numbering {
    /// A gap is an error.
    #[default]
    Required,
    /// A gap is reported as [`Part::Missing`].
    CountsMissing,
}

/// The definitions in the records so far.
#[derive(Default)]
pub(super) struct Contents {
    schemas: BTreeMap<u16, String>,
    /// Topic and schema name of every channel.
    pub(super) channels: BTreeMap<u16, (String, String)>,
    topics: BTreeMap<u16, Topic>,
    numbering: Numbering,
    channel_numbers: [ChannelNumbers; 3],
    has_chunk: bool,
    /// Whether the metadata record of this program is in the file.
    has_own_metadata: bool,
    /// Messages outside of the chunks, which no CRC covers.
    pub(super) unchecked_messages: u64,
    pub(super) data_ended: bool,
}

/// The message numbers of a channel.
#[derive(Clone, Copy, Debug, Default)]
struct ChannelNumbers {
    next: u64,
    /// Every message has the number 0, which in MCAP means *not numbered*.
    is_unused: bool,
}

impl ChannelNumbers {
    /// Counts the next message; returns how many are missing before it.
    fn count(&mut self, topic: Topic, number: u32) -> Result<u64, String> {
        self.is_unused |= self.next == 1 && number == 0;
        let expected = if self.is_unused { 0 } else { self.next as u32 };
        let missing = number.wrapping_sub(expected);
        if missing > u32::MAX / 2 || (self.is_unused && missing > 0) {
            let name = topic.name();
            return Err(format!(
                "message {number} of {name} follows, but message {expected} was expected"
            ));
        }
        self.next += u64::from(missing) + 1;
        Ok(u64::from(missing))
    }
}

impl Contents {
    /// For a file that is salvaged, with definitions from elsewhere.
    pub(super) fn salvaging(definitions: Option<Contents>) -> Contents {
        Contents {
            numbering: Numbering::CountsMissing,
            ..definitions.unwrap_or_default()
        }
    }

    /// Takes one record of the file.
    pub(super) fn record(
        &mut self,
        opcode: u8,
        data: &[u8],
        take: &mut Take,
    ) -> Result<(), String> {
        match opcode {
            op::DATA_END => self.end_data(data),
            _ if self.data_ended => {} // the summary repeats earlier records
            op::CHUNK => self.chunk(data, take)?,
            op::ATTACHMENT => attachment(data, take)?,
            op::METADATA => self.metadata(data, take)?,
            op::MESSAGE => self.bare_message(data, take)?,
            op::SCHEMA | op::CHANNEL => self.define(opcode, data)?,
            _ => {} // indexes, and what a later version of MCAP may add
        }
        Ok(())
    }

    /// Reads a chunk with a separate reader, which checks the CRC before it returns a record.
    fn chunk(&mut self, chunk: &[u8], take: &mut Take) -> Result<(), String> {
        check_chunk(chunk)?;
        self.has_chunk = true;
        let mut reader = chunk_reader(chunk);
        while let Some(event) = reader.next_event() {
            match event.map_err(|e| error::why(&e))? {
                LinearReadEvent::Record {
                    opcode: op::MESSAGE,
                    data,
                } => self.message(data, take)?,
                LinearReadEvent::Record { opcode, data } => self.define(opcode, data)?,
                LinearReadEvent::ReadRequest(_) => reader.notify_read(0), // the end of the chunk
            }
        }
        Ok(())
    }

    /// A message that is in no chunk. In a file with chunks it is a damaged record.
    fn bare_message(&mut self, data: &[u8], take: &mut Take) -> Result<(), String> {
        if self.has_chunk {
            return Err("a message outside of the chunks".into());
        }
        self.unchecked_messages += 1;
        self.message(data, take)
    }

    /// The reader has checked the CRC of the data section, unless it is zero.
    fn end_data(&mut self, data: &[u8]) {
        self.data_ended = true;
        if data.iter().any(|byte| *byte != 0) {
            self.unchecked_messages = 0;
        }
    }

    fn metadata(&mut self, data: &[u8], take: &mut Take) -> Result<(), String> {
        match parse_record(op::METADATA, data).map_err(|e| error::why(&e))? {
            Record::Metadata(metadata) => {
                self.has_own_metadata |= metadata.name == METADATA_RECORD;
                take(Part::Metadata(metadata))
            }
            _ => Ok(()),
        }
    }

    /// Adds the definition of a schema or a channel.
    pub(super) fn define(&mut self, opcode: u8, data: &[u8]) -> Result<(), String> {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL) {
            return Ok(());
        }
        match parse_record(opcode, data).map_err(|e| error::why(&e))? {
            Record::Schema { header, .. } => drop(self.schemas.insert(header.id, header.name)),
            Record::Channel(channel) => self.add_channel(channel),
            _ => {}
        }
        Ok(())
    }

    fn add_channel(&mut self, channel: Channel) {
        let schema = self.schemas.get(&channel.schema_id);
        let schema = schema.cloned().unwrap_or_default();
        let is_same = |t: &Topic| t.name() == channel.topic && t.schema_name() == schema;
        let topic = Topic::ALL.into_iter().find(is_same);
        self.topics.extend(topic.map(|topic| (channel.id, topic)));
        self.channels.insert(channel.id, (channel.topic, schema));
    }

    /// A message consists of its channel (u16), its number in the channel (u32), two times (u64) and its data.
    fn message(&mut self, message: &[u8], take: &mut Take) -> Result<(), String> {
        let Some((header, data)) = message.split_first_chunk::<22>() else {
            return Err("a message without a header".into());
        };
        let [c0, c1, n0, n1, n2, n3, ..] = *header;
        let Some(&topic) = self.topics.get(&u16::from_le_bytes([c0, c1])) else {
            return Ok(()); // a channel of another program
        };
        let number = u32::from_le_bytes([n0, n1, n2, n3]);
        let missing = self.channel_numbers[topic as usize].count(topic, number)?;
        self.report_missing(topic, number, missing, take)?;
        take(Part::Message { topic, data })
    }

    fn report_missing(
        &self,
        topic: Topic,
        number: u32,
        messages: u64,
        take: &mut Take,
    ) -> Result<(), String> {
        match self.numbering {
            _ if messages == 0 => Ok(()),
            Numbering::CountsMissing => take(Part::Missing { topic, messages }),
            Numbering::Required => {
                let (first, name) = (number.wrapping_sub(messages as u32), topic.name());
                Err(format!(
                    "message {first} of {name} is missing, {number} follows"
                ))
            }
        }
    }

    /// Reports the messages after the last one, by the number of messages that the summary states.
    pub(super) fn report_missing_at_end(
        &self,
        counts: &BTreeMap<u16, u64>,
        take: &mut Take,
    ) -> Result<(), String> {
        for (channel, count) in counts {
            let Some(&topic) = self.topics.get(channel) else {
                continue;
            };
            let messages = count.saturating_sub(self.channel_numbers[topic as usize].next);
            if messages > 0 {
                take(Part::Missing { topic, messages })?;
            }
        }
        Ok(())
    }

    /// Assumes the channels of this program if none is defined, for a file with its metadata whose definitions are damaged.
    pub(super) fn assume_own_channels(&mut self) {
        if self.has_own_metadata && self.channels.is_empty() {
            self.topics.extend((1..).zip(Topic::ALL));
        }
    }

    /// Whether this is the metadata record of this program, of which the file already has one.
    pub(super) fn repeats_own_metadata(&self, metadata: &[u8]) -> bool {
        self.has_own_metadata && is_intact(op::METADATA, metadata)
    }

    /// Whether a message of this program was read.
    pub(super) fn has_messages(&self) -> bool {
        self.channel_numbers.iter().any(|numbers| numbers.next > 0)
    }

    /// Whether the file has the channel with the ticks.
    pub(super) fn has_loop(&self) -> bool {
        self.topics.values().any(|t| *t == Topic::Loop)
    }
}

fn chunk_reader(chunk: &[u8]) -> LinearReader {
    let options = LinearReaderOptions::default()
        .with_skip_start_magic(true)
        .with_skip_end_magic(true)
        .with_prevalidate_chunk_crcs(true)
        .with_record_length_limit(CHUNK_BYTES);
    let mut reader = LinearReader::new_with_options(options);
    let room = reader.insert(9 + chunk.len());
    room[0] = op::CHUNK;
    room[1..9].copy_from_slice(&(chunk.len() as u64).to_le_bytes());
    room[9..].copy_from_slice(chunk);
    reader.notify_read(9 + chunk.len());
    reader
}

/// Refuses a chunk that `mcap` would not check (no CRC) or would panic at (a length beyond the end of an uncompressed chunk).
fn check_chunk(chunk: &[u8]) -> Result<(), String> {
    let Record::Chunk { header, data } =
        parse_record(op::CHUNK, chunk).map_err(|e| error::why(&e))?
    else {
        return Err("a chunk with the content of another record".into());
    };
    match header.compression.as_str() {
        _ if header.uncompressed_crc == 0 => Err("a chunk without a CRC".into()),
        "" if !is_framed(&data) => Err("a record that reaches beyond its chunk".into()),
        "" | "lz4" | "zstd" => Ok(()),
        other => Err(format!(
            "a chunk with the compression {other:?}, which is none of lz4 and zstd"
        )),
    }
}

/// Whether `records` is a sequence of (opcode, length u64, content) without a rest.
fn is_framed(mut records: &[u8]) -> bool {
    while let Some((head, rest)) = records.split_first_chunk::<9>() {
        let [_, length @ ..] = *head;
        let length = usize::try_from(u64::from_le_bytes(length)).ok();
        let Some(next) = length.and_then(|length| rest.get(length..)) else {
            return false;
        };
        records = next;
    }
    records.is_empty()
}

/// Whether a record has a CRC that holds, or is the metadata record of this program. A search for records trusts only those.
pub(super) fn is_intact(opcode: u8, data: &[u8]) -> bool {
    let no_take: &mut Take = &mut |_| Ok(());
    match opcode {
        op::CHUNK => {
            check_chunk(data).is_ok() && matches!(chunk_reader(data).next_event(), Some(Ok(_)))
        }
        op::ATTACHMENT => attachment(data, no_take).is_ok(),
        op::METADATA => {
            let mut contents = Contents::default();
            contents.metadata(data, no_take).is_ok() && contents.has_own_metadata
        }
        _ => false,
    }
}

fn attachment(data: &[u8], take: &mut Take) -> Result<(), String> {
    if !attachment_is_framed(data) {
        return Err("an attachment shorter than its own header".into());
    }
    let record = parse_record(op::ATTACHMENT, data);
    match record.map_err(|error| attachment_text(data, &error))? {
        Record::Attachment { crc: 0, .. } => Err("an attachment without a CRC".into()),
        Record::Attachment { header, data, .. } => take(Part::Attachment {
            name: header.name,
            media_type: header.media_type,
            data: &data,
        }),
        _ => Ok(()),
    }
}

fn attachment_text(data: &[u8], error: &McapError) -> String {
    format!(
        "attachment {}: {}",
        attachment_name(data),
        error::why(error)
    )
}

/// `mcap` panics if an attachment ends between the length and the CRC.
fn attachment_is_framed(record: &[u8]) -> bool {
    attachment_rest(record).is_some_and(|rest| rest.len() >= 8 + 4)
}

/// An attachment consists of two times (u64), name and media type (each with its length u32), the length of the content (u64),
/// the content, and a CRC (u32). Returns the part that begins with the length of the content.
fn attachment_rest(record: &[u8]) -> Option<&[u8]> {
    record.get(16..).and_then(after_text).and_then(after_text)
}

/// A chunk consists of two times and the size of its uncompressed records (u64 each), their CRC (u32), the name of the compression
/// (length u32 and text), and the length (u64) and the bytes of the records. Returns the part that begins with the length.
fn chunk_rest(record: &[u8]) -> Option<&[u8]> {
    record.get(28..).and_then(after_text)
}

/// What follows a text, which begins with its length (u32).
pub(super) fn after_text(bytes: &[u8]) -> Option<&[u8]> {
    let (length, text) = bytes.split_first_chunk::<4>()?;
    text.get(u32::from_le_bytes(*length) as usize..)
}

/// Whether the length that a record of this content has is confirmed by the lengths inside, so that it is true although
/// something else may be altered.
pub(super) fn is_length_confirmed(opcode: u8, data: &[u8]) -> bool {
    let (rest, crc_bytes) = match opcode {
        op::CHUNK => (chunk_rest(data), 0),
        op::ATTACHMENT => (attachment_rest(data), 4),
        _ => (None, 0),
    };
    rest.and_then(<[u8]>::split_first_chunk::<8>)
        .is_some_and(|(length, content)| {
            u64::from_le_bytes(*length).checked_add(crc_bytes) == Some(content.len() as u64)
        })
}

/// The name in an attachment that is framed.
fn attachment_name(record: &[u8]) -> String {
    let name = record.get(16..).and_then(|rest| {
        let (length, text) = rest.split_first_chunk::<4>()?;
        text.get(..u32::from_le_bytes(*length) as usize)
    });
    String::from_utf8_lossy(name.unwrap_or_default()).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A channel after 2^32 - 2 messages.
    fn before_the_wrap() -> ChannelNumbers {
        ChannelNumbers {
            next: u64::from(u32::MAX) - 1,
            is_unused: false,
        }
    }

    #[test]
    fn numbers_of_messages_wrap_without_a_gap() {
        let mut numbers = before_the_wrap();
        for number in [u32::MAX - 1, u32::MAX, 0, 1, 2] {
            assert_eq!(numbers.count(Topic::Loop, number), Ok(0), "{number}");
        }
        assert_eq!(numbers.next, u64::from(u32::MAX) + 4);
    }

    #[test]
    fn reports_a_gap_across_the_wrap_with_its_first_number() {
        let mut contents = Contents::default();
        contents.channel_numbers[Topic::Loop as usize] = before_the_wrap();
        // 2^32 - 2, 2^32 - 1, 0, 1 and 2 are missing.
        let missing = contents.channel_numbers[Topic::Loop as usize].count(Topic::Loop, 3);
        assert_eq!(missing, Ok(5));
        let error = contents.report_missing(Topic::Loop, 3, 5, &mut |_| Ok(()));
        let text = "message 4294967294 of /loop is missing, 3 follows";
        assert_eq!(error, Err(text.to_string()));
    }
}
