//! Reads a damaged recording: after each damage it continues with the next intact record.
//!
//! After a damage, an intact record that does not continue the recording is of another one, whose start is damaged.
//! A chunk whose opcode or length is altered is found by its index in the summary, if there is one.
//! The record after a damaged one is the one at which the length of the damaged record ends, if a record begins there.
//! Otherwise it is the next position at which a chunk or an attachment with a matching CRC begins.

use std::io;

use mcap::MAGIC;
use mcap::records::{ChunkIndex, op};

use super::contents::{Contents, Take, is_intact, is_length_confirmed};
use super::file_range::{FileRange, RECORD_HEAD_BYTES, RecordHead, is_message_index};
use super::losses::{Cut, DamagedRange};
use super::summary::Summary;

/// A reader of one damaged recording. Offsets are counted from its start; damage and cut have positions in the file.
pub(super) struct Scanner {
    pub(super) range: FileRange,
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
    has_passed_over: bool,
    /// Where the recording ends because an intact record of another one follows.
    pub(super) ends_before_another: Option<u64>,
}

impl Scanner {
    pub(super) fn new(range: FileRange) -> io::Result<Scanner> {
        let has_magic = range.has_magic_at(0);
        let offset = range.first_record()?;
        let mut summary = Summary::read(&range);
        let definitions = summary.as_mut().map(|s| std::mem::take(&mut s.definitions));
        let mut scanner = Scanner {
            range,
            offset,
            before: 0,
            search_from: if has_magic { offset } else { 0 },
            crc: has_magic.then(crc32fast::Hasher::new),
            summary,
            contents: Contents::salvaging(definitions),
            damage: Vec::new(),
            cut: None,
            has_magic,
            has_passed_over: false,
            ends_before_another: None,
        };
        match &mut scanner.crc {
            Some(crc) => crc.update(MAGIC),
            None if offset == 0 => {
                scanner.note_damage(
                    0,
                    0,
                    "the start of the recording before it is missing".into(),
                );
            }
            None => scanner.note_damage(0, offset, "the magic of MCAP is altered".into()),
        }
        Ok(scanner)
    }

    /// Reads one record, or passes over a damage; `false` at the end of the data.
    pub(super) fn step(&mut self, take: &mut Take) -> io::Result<bool> {
        let Some(head) = self.head_here()? else {
            return self.pass_over(self.why_no_record()?, take);
        };
        let data = self.range.data_of(head)?;
        let checked = self.check(head, &data);
        let taken = checked.and_then(|()| self.contents.record(head.opcode, &data, take));
        let taken = taken.or_else(|why| match self.take_repaired(&data, &why, take) {
            Ok(true) => Ok(()),
            Ok(false) => Err(why),
            Err(why) => Err(why),
        });
        match taken {
            Ok(()) => self.advance(head, &data, take),
            Err(_) if self.is_of_another(head, &data) => {
                self.end_before_another();
                Ok(false)
            }
            Err(why) => self.pass_over(why, take),
        }
    }

    /// Whether an intact record that does not continue this recording is of another one.
    fn is_of_another(&self, head: RecordHead, data: &[u8]) -> bool {
        let is_begun = self.contents.has_messages() || head.opcode == op::METADATA;
        self.has_passed_over && is_begun && is_intact(head.opcode, data)
    }

    /// The damage directly before the other recording is the end of this one: how much is missing there is not known.
    fn end_before_another(&mut self) {
        let at_byte = self.range.from_byte + self.offset;
        let last = self.damage.pop_if(|damage| damage.to_byte == at_byte);
        self.cut = Some(Cut {
            at_byte: last.map_or(at_byte, |damage| damage.from_byte),
            of_bytes: at_byte,
            why: "another recording follows, whose start is missing".into(),
        });
        self.ends_before_another = Some(at_byte);
    }

    /// The record at `offset`. Where an intact chunk begins by the index of the chunks, its head may be altered.
    fn head_here(&mut self) -> io::Result<Option<RecordHead>> {
        let found = self.range.head_at(self.offset)?;
        let Some(indexed) = self.indexed_chunk().filter(|head| found != Some(*head)) else {
            return Ok(found);
        };
        if !is_intact(indexed.opcode, &self.range.data_of(indexed)?) {
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
        (head.data_at <= self.range.bytes && self.range.contains(&head)).then_some(head)
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
        self.search_from = if is_length_confirmed(head.opcode, data) {
            self.offset
        } else {
            self.search_from.max(self.before + 1)
        };
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
            op::METADATA if self.has_passed_over && self.contents.repeats_own_metadata(data) => {
                Err("the metadata of another recording".into())
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
            .range
            .bytes
            .saturating_sub(self.offset + RECORD_HEAD_BYTES as u64);
        Ok(match self.range.any_head_at(self.offset)? {
            Some(head) if head.data_bytes <= left => "no record of MCAP begins there".into(),
            _ if self.range.is_followed => "another recording begins within a record".into(),
            _ => "the file ends within a record".into(),
        })
    }

    /// Continues with the next intact record, or ends.
    fn pass_over(&mut self, why: String, take: &mut Take) -> io::Result<bool> {
        self.crc = None;
        self.contents.data_ended = false;
        self.contents.assume_own_channels();
        self.has_passed_over = true;
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
                    at_byte: self.range.from_byte + from.min(self.range.bytes),
                    of_bytes: self.range.from_byte + self.range.bytes,
                    why,
                });
                self.end(take)?;
                Ok(false)
            }
        }
    }

    fn note_damage(&mut self, from_byte: u64, to_byte: u64, why: String) {
        self.damage.push(DamagedRange {
            from_byte: self.range.from_byte + from_byte,
            to_byte: self.range.from_byte + to_byte,
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
        if let Some(head) = self.range.head_at(self.offset)?
            && self.range.is_plausible_at(head.end())?
        {
            if self.may_hide_records(head)? {
                let before_end = self.range.next_intact(self.offset + 1, head.end())?;
                return Ok(Some(before_end.unwrap_or(head.end())));
            }
            return Ok(Some(head.end()));
        }
        self.range.next_intact(self.search_from, self.range.bytes)
    }

    /// An altered length may end at a later record: the intact ones before it are not passed over. The records of a recording
    /// that is the content of an attachment are not among them.
    fn may_hide_records(&self, head: RecordHead) -> io::Result<bool> {
        let is_confirmed = is_length_confirmed(head.opcode, &self.range.data_of(head)?);
        let start_inside = self.range.next_start(head.start(), head.end())?;
        Ok(!is_confirmed && start_inside.is_none())
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
