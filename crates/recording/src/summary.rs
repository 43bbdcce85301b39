//! The summary at the end of an MCAP file, which repeats the definitions and states what the file contains.

use std::collections::BTreeMap;
use std::fs::File;
use std::os::unix::fs::FileExt;

use mcap::records::{ChunkIndex, Footer, Record, op};
use mcap::{MAGIC, parse_record};

use super::contents::Contents;

/// Opcode and length of a record.
pub(super) const RECORD_HEAD_BYTES: usize = 1 + 8;
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
    /// The chunks by their start.
    pub(super) chunks: BTreeMap<u64, ChunkIndex>,
}

impl Summary {
    /// Reads the summary of a file of this length; `None` if there is none, or if its CRC does not hold.
    pub(super) fn read(file: &File, file_bytes: u64) -> Option<Summary> {
        let records = summary_records(file, file_bytes)?;
        let mut summary = Summary::default();
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
                self.chunks.insert(index.chunk_start_offset, index);
            }
            _ => {}
        }
        Some(())
    }
}

/// The records of the summary, before the footer.
fn summary_records(file: &File, file_bytes: u64) -> Option<Vec<u8>> {
    let end = file_bytes.checked_sub(END_BYTES as u64)?;
    let mut tail = [0; END_BYTES];
    file.read_exact_at(&mut tail, end).ok()?;
    let footer = footer(&tail)?;
    let length = end.checked_sub(footer.summary_start)?;
    if footer.summary_start == 0 || length > SUMMARY_BYTES {
        return None;
    }
    let mut records = vec![0; length as usize];
    file.read_exact_at(&mut records, footer.summary_start)
        .ok()?;
    let mut crc = crc32fast::Hasher::new();
    crc.update(&records);
    crc.update(&tail[..RECORD_HEAD_BYTES + FOOTER_BYTES - 4]);
    let holds = footer.summary_crc == 0 || footer.summary_crc == crc.finalize();
    holds.then_some(records)
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
