//! The summary at the end of an MCAP file, which repeats the definitions and states what the file contains.

use std::collections::BTreeMap;

use mcap::records::{ChunkIndex, Footer, Record, op};
use mcap::{MAGIC, parse_record};

use super::contents::Contents;
use super::file_range::{FileRange, RECORD_HEAD_BYTES};

/// Content of the footer: two offsets (u64) and the CRC of the summary (u32).
const FOOTER_BYTES: usize = 8 + 8 + 4;
/// The footer with its head, and the magic.
const END_BYTES: usize = RECORD_HEAD_BYTES + FOOTER_BYTES + MAGIC.len();
/// A longer summary is not read.
const SUMMARY_BYTES: u64 = 256 << 20;

/// The summary of a file.
#[derive(Default)]
pub(super) struct Summary {
    /// The definitions of the channels.
    pub(super) definitions: Contents,
    /// Number of messages by channel.
    pub(super) messages: BTreeMap<u16, u64>,
    /// Names of the attachments.
    pub(super) attachments: Vec<String>,
    /// Bytes that are missing at the start of the recording, from which offsets are counted; negative if there are more.
    missing_bytes: i128,
    /// The chunks by their start.
    pub(super) chunks: BTreeMap<u64, ChunkIndex>,
}

impl Summary {
    /// Reads the summary at the end of `range`; `None` if there is none, or if its CRC does not hold.
    pub(super) fn read(range: &FileRange) -> Option<Summary> {
        let (records, missing_bytes) = summary_records(range)?;
        let mut summary = Summary {
            missing_bytes,
            ..Summary::default()
        };
        let mut rest = records.as_slice();
        while let Some((head, after)) = rest.split_first_chunk::<RECORD_HEAD_BYTES>() {
            let [opcode, length @ ..] = *head;
            let length = usize::try_from(u64::from_le_bytes(length)).ok()?;
            let data = after.get(..length)?;
            summary.add(opcode, data)?;
            rest = &after[length..];
        }
        Some(summary)
    }

    fn add(&mut self, opcode: u8, data: &[u8]) -> Option<()> {
        if matches!(opcode, op::SCHEMA | op::CHANNEL) {
            return self.definitions.define(opcode, data).ok();
        }
        match parse_record(opcode, data).ok()? {
            Record::Statistics(statistics) => self.messages = statistics.channel_message_counts,
            Record::AttachmentIndex(index) => self.attachments.push(index.name),
            Record::ChunkIndex(index) => {
                let start = i128::from(index.chunk_start_offset) - self.missing_bytes;
                self.chunks
                    .extend(u64::try_from(start).ok().map(|start| (start, index)));
            }
            _ => {}
        }
        Some(())
    }
}

/// The records of the summary, before the footer, and the number of missing bytes before them. They are known only without the start
/// of the recording and with the end of its data, and are trusted only with a CRC.
fn summary_records(range: &FileRange) -> Option<(Vec<u8>, i128)> {
    let end = range.bytes.checked_sub(END_BYTES as u64)?;
    let mut tail = [0; END_BYTES];
    range.read_exact_at(&mut tail, end).ok()?;
    let footer = footer(&tail)?;
    let found_at = range.summary_at.filter(|_| !range.has_magic_at(0));
    let start = found_at.unwrap_or(footer.summary_start);
    let missing_bytes = i128::from(footer.summary_start) - i128::from(start);
    let length = end.checked_sub(start)?;
    let has_no_proof = footer.summary_crc == 0 && missing_bytes != 0;
    if footer.summary_start == 0 || length > SUMMARY_BYTES || has_no_proof {
        return None;
    }
    let mut records = vec![0; length as usize];
    range.read_exact_at(&mut records, start).ok()?;
    let mut crc = crc32fast::Hasher::new();
    crc.update(&records);
    crc.update(&tail[..RECORD_HEAD_BYTES + FOOTER_BYTES - 4]);
    let holds = footer.summary_crc == 0 || footer.summary_crc == crc.finalize();
    holds.then_some((records, missing_bytes))
}

fn footer(tail: &[u8; END_BYTES]) -> Option<Footer> {
    let (record, magic) = tail.split_at(RECORD_HEAD_BYTES + FOOTER_BYTES);
    let (head, data) = record.split_at(RECORD_HEAD_BYTES);
    if magic != MAGIC || head[0] != op::FOOTER || head[1..] != (FOOTER_BYTES as u64).to_le_bytes() {
        return None;
    }
    match parse_record(op::FOOTER, data).ok()? {
        Record::Footer(footer) => Some(footer),
        _ => None,
    }
}
