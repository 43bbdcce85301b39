//! Reads a damaged file: after each damage it continues with the next intact record.
//!
//! A chunk whose opcode or length is altered is found by its index in the summary, if there is one.
//! The record after a damaged one is the one at which the length of the damaged record ends, if a record begins there.
//! Otherwise it is the next position at which a chunk or an attachment with a matching CRC begins.

use std::fs::File;
use std::io;
use std::os::unix::fs::FileExt;

use mcap::MAGIC;
use mcap::records::{ChunkIndex, op};

use super::contents::{Contents, Take, is_intact};
use super::losses::{Cut, DamagedRange};
use super::summary::{RECORD_HEAD_BYTES, Summary};
use super::walk::RECORD_BYTES;

/// Bytes that are searched at a time.
const SEARCH_BYTES: usize = 1 << 20;

/// A reader of one damaged file.
pub(super) struct Scanner {
    file: File,
    file_bytes: u64,
    /// Start of the current record.
    pub(super) offset: u64,
    /// Start of the record before it.
    before: u64,
    /// Where the next search begins at the earliest.
    search_from: u64,
    /// CRC of everything before `offset`; `None` after a damage.
    crc: Option<crc32fast::Hasher>,
    pub(super) summary: Option<Summary>,
    pub(super) contents: Contents,
    pub(super) damage: Vec<DamagedRange>,
    /// Where reading ended before the end of the data.
    pub(super) cut: Option<Cut>,
    pub(super) has_magic: bool,
}

/// Opcode, and position of the content.
#[derive(Clone, Copy, PartialEq, Eq)]
struct RecordHead {
    opcode: u8,
    data_at: u64,
    data_bytes: u64,
}

impl RecordHead {
    /// Start of the next record.
    fn end(&self) -> u64 {
        self.data_at + self.data_bytes
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

impl Scanner {
    pub(super) fn new(file: File) -> io::Result<Scanner> {
        let file_bytes = file.metadata()?.len();
        let mut start = [0; MAGIC.len()];
        let has_magic = file.read_exact_at(&mut start, 0).is_ok() && start == *MAGIC;
        let mut summary = Summary::read(&file, file_bytes);
        let definitions = summary.as_mut().map(|s| std::mem::take(&mut s.definitions));
        let mut scanner = Scanner {
            file,
            file_bytes,
            offset: MAGIC.len() as u64,
            before: 0,
            search_from: 0,
            crc: has_magic.then(crc32fast::Hasher::new),
            summary,
            contents: Contents::salvaging(definitions),
            damage: Vec::new(),
            cut: None,
            has_magic,
        };
        match &mut scanner.crc {
            Some(crc) => crc.update(MAGIC),
            None => {
                scanner.note_damage(0, MAGIC.len() as u64, "the magic of MCAP is altered".into())
            }
        }
        Ok(scanner)
    }

    /// Reads one record, or passes over a damage; `false` at the end of the data.
    pub(super) fn step(&mut self, take: &mut Take) -> io::Result<bool> {
        let Some(head) = self.head_here()? else {
            return self.pass_over(self.why_no_record()?, take);
        };
        let data = self.data_of(head)?;
        let checked = self.check(head, &data);
        let taken = checked.and_then(|()| self.contents.record(head.opcode, &data, take));
        let taken = taken.or_else(|why| match self.take_repaired(&data, &why, take) {
            Ok(true) => Ok(()),
            Ok(false) => Err(why),
            Err(why) => Err(why),
        });
        match taken {
            Ok(()) => self.advance(head, &data, take),
            Err(why) => self.pass_over(why, take),
        }
    }

    /// The record at `offset`. Where an intact chunk begins by the index of the chunks, its head may be altered.
    fn head_here(&mut self) -> io::Result<Option<RecordHead>> {
        let found = self.head_at(self.offset)?;
        let Some(indexed) = self.indexed_chunk().filter(|head| found != Some(*head)) else {
            return Ok(found);
        };
        if !is_intact(indexed.opcode, &self.data_of(indexed)?) {
            return Ok(found);
        }
        let why =
            "the opcode or the length of a chunk is altered; the index of the chunks states it";
        self.note_damage(self.offset, indexed.data_at, why.into());
        self.crc = None;
        Ok(Some(indexed))
    }

    /// The chunk that begins at `offset` by the index of the chunks.
    fn indexed_chunk(&self) -> Option<RecordHead> {
        let length = self.chunk_index()?.chunk_length;
        let head = RecordHead {
            opcode: op::CHUNK,
            data_at: self.offset.checked_add(RECORD_HEAD_BYTES as u64)?,
            data_bytes: length.checked_sub(RECORD_HEAD_BYTES as u64)?,
        };
        (head.data_at <= self.file_bytes && self.contains(&head)).then_some(head)
    }

    /// What the summary states of the chunk that begins at `offset`.
    fn chunk_index(&self) -> Option<&ChunkIndex> {
        self.summary.as_ref()?.chunks.get(&self.offset)
    }

    /// Takes a damaged chunk if it is intact with the sizes and the compression that its index states; `false` if not.
    fn take_repaired(&mut self, chunk: &[u8], why: &str, take: &mut Take) -> Result<bool, String> {
        let index = self.chunk_index();
        let repaired = index.and_then(|index| with_header_of_index(chunk, index));
        let Some(repaired) = repaired.filter(|repaired| repaired != chunk) else {
            return Ok(false);
        };
        if !is_intact(op::CHUNK, &repaired) {
            return Ok(false);
        }
        let why = format!("{why}; the index of the chunks states the true header");
        self.note_damage(
            self.offset,
            self.offset + RECORD_HEAD_BYTES as u64 + 24,
            why,
        );
        self.crc = None;
        self.contents.record(op::CHUNK, &repaired, take)?;
        Ok(true)
    }

    fn advance(&mut self, head: RecordHead, data: &[u8], take: &mut Take) -> io::Result<bool> {
        if let Some(crc) = &mut self.crc {
            crc.update(&[head.opcode]);
            crc.update(&head.data_bytes.to_le_bytes());
            crc.update(data);
        }
        self.before = self.offset;
        self.offset = head.end();
        if self.contents.data_ended {
            self.end(take)?;
        }
        Ok(!self.contents.data_ended)
    }

    /// Refuses what [`Contents`] ignores, but what does not belong in a data section that is not damaged.
    fn check(&mut self, head: RecordHead, data: &[u8]) -> Result<(), String> {
        match head.opcode {
            op::MESSAGE_INDEX if !is_message_index(data) => {
                Err("a message index of another length".into())
            }
            op::HEADER if head.data_at != (MAGIC.len() + RECORD_HEAD_BYTES) as u64 => {
                Err("a header in the middle of the file".into())
            }
            op::DATA_END => self.check_data_crc(data),
            _ => Ok(()),
        }
    }

    /// With every other record intact, a wrong CRC means that a record without a CRC of its own is altered.
    fn check_data_crc(&mut self, data: &[u8]) -> Result<(), String> {
        let crc = self.crc.take().map(crc32fast::Hasher::finalize);
        match crc {
            Some(crc) if data != [0; 4] && data != crc.to_le_bytes() => {
                let why = "the CRC of the whole file is wrong: the metadata, an index or this CRC is altered";
                self.note_damage(self.offset, self.offset + 13, why.into());
            }
            _ => {}
        }
        Ok(())
    }

    fn why_no_record(&self) -> io::Result<String> {
        let left = self
            .file_bytes
            .saturating_sub(self.offset + RECORD_HEAD_BYTES as u64);
        Ok(match self.any_head_at(self.offset)? {
            Some(head) if head.data_bytes <= left => "no record of MCAP begins there".into(),
            _ => "the file ends within a record".into(),
        })
    }

    /// Continues with the next intact record, or ends.
    fn pass_over(&mut self, why: String, take: &mut Take) -> io::Result<bool> {
        self.crc = None;
        self.contents.data_ended = false;
        self.contents.assume_own_channels();
        let from = self.offset;
        match self.next_record()? {
            Some(next) => {
                self.search_from = next + 1;
                // Before `from`: the length of the record before is altered.
                let from = if next > from { from } else { self.before };
                self.note_damage(from, next, why);
                self.offset = next;
                Ok(true)
            }
            None => {
                self.cut = Some(Cut {
                    at_byte: from.min(self.file_bytes),
                    of_bytes: self.file_bytes,
                    why,
                });
                self.end(take)?;
                Ok(false)
            }
        }
    }

    fn note_damage(&mut self, from_byte: u64, to_byte: u64, why: String) {
        self.damage.push(DamagedRange {
            from_byte,
            to_byte,
            why,
        });
    }

    /// Reports the messages that are missing at the end, if the summary states how many there are.
    fn end(&mut self, take: &mut Take) -> io::Result<()> {
        let Some(summary) = &self.summary else {
            return Ok(());
        };
        let reported = self.contents.report_missing_at_end(&summary.messages, take);
        reported.map_err(io::Error::other)
    }

    /// Start of the next record after the damage at `offset`.
    fn next_record(&self) -> io::Result<Option<u64>> {
        if let Some(head) = self.head_at(self.offset)?
            && self.is_plausible_at(head.end())?
        {
            // An altered length may end at a later record: the intact ones before it are not passed over.
            let before_end = self.search(self.offset + 1, head.end())?;
            return Ok(Some(before_end.unwrap_or(head.end())));
        }
        self.search(self.search_from.max(self.before + 1), self.file_bytes)
    }

    /// Whether a record at a position is most probably one.
    fn is_plausible_at(&self, position: u64) -> io::Result<bool> {
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
    fn search(&self, from: u64, end: u64) -> io::Result<Option<u64>> {
        let mut block = vec![0; SEARCH_BYTES];
        let mut start = from;
        while start < end {
            let length = (end - start).min(SEARCH_BYTES as u64);
            let block = &mut block[..length as usize];
            self.file.read_exact_at(block, start)?;
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
        is_verifiable && length.is_none_or(|length| u64::from_le_bytes(*length) < self.file_bytes)
    }

    fn is_intact_at(&self, position: u64) -> io::Result<bool> {
        match self.head_at(position)? {
            Some(head) => Ok(is_intact(head.opcode, &self.data_of(head)?)),
            None => Ok(false),
        }
    }

    /// The record at a position; `None` if no record of a data section that fits in the file begins there.
    fn head_at(&self, position: u64) -> io::Result<Option<RecordHead>> {
        let head = self.any_head_at(position)?;
        Ok(head.filter(|head| head.is_of_data_section() && self.contains(head)))
    }

    fn contains(&self, head: &RecordHead) -> bool {
        let left = self.file_bytes - head.data_at;
        head.data_bytes <= left.min(RECORD_BYTES as u64)
    }

    /// Opcode and length at a position, whatever they are; `None` at the end of the file.
    fn any_head_at(&self, position: u64) -> io::Result<Option<RecordHead>> {
        let data_at = position.saturating_add(RECORD_HEAD_BYTES as u64);
        if data_at > self.file_bytes {
            return Ok(None);
        }
        let mut head = [0; RECORD_HEAD_BYTES];
        self.file.read_exact_at(&mut head, position)?;
        let [opcode, length @ ..] = head;
        Ok(Some(RecordHead {
            opcode,
            data_at,
            data_bytes: u64::from_le_bytes(length),
        }))
    }

    fn data_of(&self, head: RecordHead) -> io::Result<Vec<u8>> {
        let mut data = vec![0; head.data_bytes as usize];
        self.file.read_exact_at(&mut data, head.data_at)?;
        Ok(data)
    }
}

/// A chunk with the sizes and the compression of its index. A chunk consists of two times and the size of its uncompressed
/// records (u64 each), their CRC (u32), the name of the compression (length u32 and text), and the length (u64) and the bytes of
/// the records. `None` if the lengths do not fit.
fn with_header_of_index(chunk: &[u8], index: &ChunkIndex) -> Option<Vec<u8>> {
    let records = usize::try_from(index.compressed_size).ok()?;
    let compression = index.compression.as_bytes();
    let header_bytes = 3 * 8 + 4 + 4 + compression.len() + 8;
    if chunk.len() != header_bytes.checked_add(records)? {
        return None;
    }
    let mut repaired = chunk[..16].to_vec();
    repaired.extend(index.uncompressed_size.to_le_bytes());
    repaired.extend(&chunk[24..28]);
    repaired.extend(u32::try_from(compression.len()).ok()?.to_le_bytes());
    repaired.extend(compression);
    repaired.extend(index.compressed_size.to_le_bytes());
    repaired.extend(&chunk[header_bytes..]);
    Some(repaired)
}

/// A channel (u16), the length of the entries (u32), and entries of a time and an offset (u64).
fn is_message_index(data: &[u8]) -> bool {
    match data.split_first_chunk::<6>() {
        Some((&[_, _, n0, n1, n2, n3], entries)) => {
            entries.len().is_multiple_of(16)
                && entries.len() == u32::from_le_bytes([n0, n1, n2, n3]) as usize
        }
        None => false,
    }
}
