//! Records in a part of a file, found by position. Positions are counted from the start of the part.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

use mcap::MAGIC;
use mcap::records::op;
use memchr::memmem;

use super::contents::{after_text, is_intact};
use super::walk::RECORD_BYTES;

/// Opcode and length of a record.
pub(super) const RECORD_HEAD_BYTES: usize = 1 + 8;
/// Bytes that are searched at a time.
const SEARCH_BYTES: usize = 1 << 20;
/// Largest header of a file, which holds the names of a profile and of a library.
const HEADER_BYTES: u64 = 64 << 10;

/// A part of a file.
pub(super) struct FileRange {
    file: File,
    /// Its first byte in the file.
    pub(super) from_byte: u64,
    /// Its length.
    pub(super) bytes: u64,
    /// Whether the file goes on after it.
    pub(super) is_followed: bool,
    /// The summary, if it was found by the records before it.
    pub(super) summary_at: Option<u64>,
}

/// The end of a recording in a file, counted from the start of the recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct RecordingEnd {
    pub(super) bytes: u64,
    /// The summary, if the recording has the end of its data.
    pub(super) summary_at: Option<u64>,
}

/// Opcode, and position of the content.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct RecordHead {
    pub(super) opcode: u8,
    pub(super) data_at: u64,
    pub(super) data_bytes: u64,
}

impl RecordHead {
    pub(super) fn start(&self) -> u64 {
        self.data_at - RECORD_HEAD_BYTES as u64
    }

    /// Start of the next record.
    pub(super) fn end(&self) -> u64 {
        self.data_at.saturating_add(self.data_bytes)
    }

    fn is_of_data_section(&self) -> bool {
        match self.opcode {
            op::HEADER | op::SCHEMA | op::CHANNEL | op::MESSAGE | op::CHUNK => true,
            op::MESSAGE_INDEX | op::ATTACHMENT | op::METADATA => true,
            op::DATA_END => self.data_bytes == 4,
            _ => false,
        }
    }
}

impl FileRange {
    /// Everything from `from_byte` to the end of the file.
    pub(super) fn to_end(file: File, from_byte: u64) -> io::Result<FileRange> {
        let bytes = file.metadata()?.len().saturating_sub(from_byte);
        Ok(FileRange {
            file,
            from_byte,
            bytes,
            is_followed: false,
            summary_at: None,
        })
    }

    /// The recording at the start of this part.
    pub(super) fn up_to(self, end: RecordingEnd) -> FileRange {
        FileRange {
            bytes: end.bytes.min(self.bytes),
            is_followed: self.is_followed || end.bytes < self.bytes,
            summary_at: end.summary_at,
            ..self
        }
    }

    pub(super) fn read_exact_at(&self, buffer: &mut [u8], position: u64) -> io::Result<()> {
        let end = position.checked_add(buffer.len() as u64);
        if end.is_none_or(|end| end > self.bytes) {
            return Err(io::ErrorKind::UnexpectedEof.into());
        }
        self.file.read_exact_at(buffer, self.from_byte + position)
    }

    pub(super) fn has_magic_at(&self, position: u64) -> bool {
        let mut magic = [0; MAGIC.len()];
        self.read_exact_at(&mut magic, position).is_ok() && magic == *MAGIC
    }

    /// Whether a recording begins at a position: magic and header. At its end, nothing or another magic follows the magic.
    pub(super) fn is_start(&self, position: u64) -> io::Result<bool> {
        if !self.has_magic_at(position) {
            return Ok(false);
        }
        match self.head_at(position + MAGIC.len() as u64)? {
            Some(head) if head.opcode == op::HEADER && head.data_bytes <= HEADER_BYTES => {
                let texts = self.data_of(head)?;
                Ok(after_text(&texts).and_then(after_text).is_some())
            }
            _ => Ok(false),
        }
    }

    /// The first position in `from..end` at which a recording begins.
    pub(super) fn next_start(&self, from: u64, end: u64) -> io::Result<Option<u64>> {
        let finder = memmem::Finder::new(MAGIC);
        let mut block = vec![0; SEARCH_BYTES + MAGIC.len() - 1]; // a magic may lie across the end of a block
        let mut start = from;
        while start < end.min(self.bytes) {
            let length = (self.bytes - start).min(block.len() as u64);
            let block = &mut block[..length as usize];
            self.read_exact_at(block, start)?;
            let positions = finder.find_iter(block).map(|index| start + index as u64);
            for position in positions.filter(|position| *position < end) {
                if self.is_start(position)? {
                    return Ok(Some(position));
                }
            }
            start += SEARCH_BYTES as u64;
        }
        Ok(None)
    }

    /// Where the first record begins: after the magic, also after an altered one. If magic and header are missing, it is the start.
    pub(super) fn first_record(&self) -> io::Result<u64> {
        let is_headless = !self.has_magic_at(0) && self.is_intact_at(0)?;
        Ok(if is_headless { 0 } else { MAGIC.len() as u64 })
    }

    /// The record at a position; `None` if no record of a data section that fits in this part begins there.
    pub(super) fn head_at(&self, position: u64) -> io::Result<Option<RecordHead>> {
        let head = self.any_head_at(position)?;
        Ok(head.filter(|head| head.is_of_data_section() && self.contains(head)))
    }

    pub(super) fn contains(&self, head: &RecordHead) -> bool {
        let left = self.bytes.saturating_sub(head.data_at);
        head.data_bytes <= left.min(RECORD_BYTES as u64)
    }

    /// Opcode and length at a position, whatever they are; `None` at the end of this part.
    pub(super) fn any_head_at(&self, position: u64) -> io::Result<Option<RecordHead>> {
        let data_at = position.saturating_add(RECORD_HEAD_BYTES as u64);
        if data_at > self.bytes {
            return Ok(None);
        }
        let mut head = [0; RECORD_HEAD_BYTES];
        self.read_exact_at(&mut head, position)?;
        let [opcode, length @ ..] = head;
        Ok(Some(RecordHead {
            opcode,
            data_at,
            data_bytes: u64::from_le_bytes(length),
        }))
    }

    /// The content of a record that this part contains.
    pub(super) fn data_of(&self, head: RecordHead) -> io::Result<Vec<u8>> {
        let mut data = vec![0; head.data_bytes as usize];
        self.read_exact_at(&mut data, head.data_at)?;
        Ok(data)
    }

    pub(super) fn is_intact_at(&self, position: u64) -> io::Result<bool> {
        match self.head_at(position)? {
            Some(head) => Ok(is_intact(head.opcode, &self.data_of(head)?)),
            None => Ok(false),
        }
    }

    /// Whether a record at a position is most probably one.
    pub(super) fn is_plausible_at(&self, position: u64) -> io::Result<bool> {
        let Some(head) = self.head_at(position)? else {
            return Ok(false);
        };
        match head.opcode {
            op::DATA_END => Ok(true),
            op::MESSAGE_INDEX => Ok(is_message_index(&self.data_of(head)?)),
            _ => self.is_intact_at(position),
        }
    }

    /// The first position in `from..end` at which an intact record begins.
    pub(super) fn next_intact(&self, from: u64, end: u64) -> io::Result<Option<u64>> {
        let mut block = vec![0; SEARCH_BYTES];
        let mut start = from;
        while start < end {
            let length = (end - start).min(SEARCH_BYTES as u64);
            let block = &mut block[..length as usize];
            self.read_exact_at(block, start)?;
            for (index, position) in (start..start + length).enumerate() {
                if self.may_begin(&block[index..]) && self.is_intact_at(position)? {
                    return Ok(Some(position));
                }
            }
            start += length;
        }
        Ok(None)
    }

    /// Whether these bytes may be the begin of a record whose content can be verified.
    fn may_begin(&self, bytes: &[u8]) -> bool {
        let is_verifiable = matches!(bytes[0], op::CHUNK | op::ATTACHMENT | op::METADATA);
        let length = bytes[1..].first_chunk::<8>();
        is_verifiable && length.is_none_or(|length| u64::from_le_bytes(*length) < self.bytes)
    }
}

/// A channel (u16), the length of the entries (u32), and entries of a time and an offset (u64).
pub(super) fn is_message_index(data: &[u8]) -> bool {
    match data.split_first_chunk::<6>() {
        Some((&[_, _, n0, n1, n2, n3], entries)) => {
            entries.len().is_multiple_of(16)
                && entries.len() == u32::from_le_bytes([n0, n1, n2, n3]) as usize
        }
        None => false,
    }
}
