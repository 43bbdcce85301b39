//! The summary at the end of an MCAP file, by which viewers find chunks, attachments and metadata.

use std::collections::BTreeMap;

use bytes::BufMut;
use mcap::records::op;

use super::mcap_records::{SpanNs, put_record, put_sized, put_text};

/// Sizes of a chunk in bytes.
#[derive(Clone, Copy)]
pub(super) struct ChunkSizes {
    pub(super) compressed: u64,
    pub(super) uncompressed: u64,
}

/// Records of one kind, encoded.
#[derive(Default)]
struct Group {
    records: Vec<u8>,
    count: u32,
}

impl Group {
    /// Appends a record; returns its bytes.
    fn push(&mut self, opcode: u8, content: impl FnOnce(&mut Vec<u8>)) -> &[u8] {
        let start = self.records.len();
        put_record(&mut self.records, opcode, content);
        self.count += 1;
        &self.records[start..]
    }
}

/// The contents of the file so far.
#[derive(Default)]
pub(super) struct McapSummary {
    schemas: Group,
    channels: Group,
    chunks: Group,
    attachments: Group,
    metadata: Group,
    span_ns: SpanNs,
    /// Messages of each channel.
    messages: BTreeMap<u16, u64>,
}

impl McapSummary {
    /// Number of the next schema; the numbers begin with 1.
    pub(super) fn next_schema(&self) -> u16 {
        self.schemas.count as u16 + 1
    }

    /// Number of the next channel; the numbers begin with 1.
    pub(super) fn next_channel(&self) -> u16 {
        self.channels.count as u16 + 1
    }

    /// Adds a schema; returns its record.
    pub(super) fn schema_record(&mut self, content: impl FnOnce(&mut Vec<u8>)) -> &[u8] {
        self.schemas.push(op::SCHEMA, content)
    }

    /// Adds a channel; returns its record.
    pub(super) fn channel_record(&mut self, content: impl FnOnce(&mut Vec<u8>)) -> &[u8] {
        self.channels.push(op::CHANNEL, content)
    }

    pub(super) fn count_message(&mut self, channel: u16, log_time_ns: u64) {
        *self.messages.entry(channel).or_default() += 1;
        self.span_ns.extend(log_time_ns);
    }

    pub(super) fn index_attachment(&mut self, content: impl FnOnce(&mut Vec<u8>)) {
        self.attachments.push(op::ATTACHMENT_INDEX, content);
    }

    pub(super) fn index_metadata(&mut self, content: impl FnOnce(&mut Vec<u8>)) {
        self.metadata.push(op::METADATA_INDEX, content);
    }

    /// Adds a chunk, given by its offset and length, with the offsets of the indexes that follow it and their length.
    pub(super) fn index_chunk(
        &mut self,
        span_ns: SpanNs,
        (offset, length): (u64, u64),
        (index_offsets, indexes_length): (&[u8], u64),
        sizes: ChunkSizes,
    ) {
        self.chunks.push(op::CHUNK_INDEX, |record| {
            span_ns.put(record);
            record.put_u64_le(offset);
            record.put_u64_le(length);
            put_sized(record, |map| map.put_slice(index_offsets));
            record.put_u64_le(indexes_length);
            put_text(record, "zstd");
            record.put_u64_le(sizes.compressed);
            record.put_u64_le(sizes.uncompressed);
        });
    }

    /// Appends summary and footer, which begin at `start` of the file. The CRC in the footer covers everything before it.
    pub(super) fn put(&self, out: &mut Vec<u8>, start: u64) {
        let mut statistics = Group::default();
        statistics.push(op::STATISTICS, |record| self.put_statistics(record));
        let groups = [
            (op::SCHEMA, &self.schemas),
            (op::CHANNEL, &self.channels),
            (op::STATISTICS, &statistics),
            (op::CHUNK_INDEX, &self.chunks),
            (op::ATTACHMENT_INDEX, &self.attachments),
            (op::METADATA_INDEX, &self.metadata),
        ];
        let mut offsets = Group::default();
        for (opcode, group) in groups.into_iter().filter(|(_, group)| group.count > 0) {
            let group_start = start + out.len() as u64;
            out.put_slice(&group.records);
            offsets.push(op::SUMMARY_OFFSET, |record| {
                record.put_u8(opcode);
                record.put_u64_le(group_start);
                record.put_u64_le(group.records.len() as u64);
            });
        }
        let offsets_start = start + out.len() as u64;
        out.put_slice(&offsets.records);
        put_record(out, op::FOOTER, |record| {
            record.put_u64_le(start);
            record.put_u64_le(offsets_start);
            record.put_u32_le(0);
        });
        let crc_at = out.len() - 4;
        let crc = crc32fast::hash(&out[..crc_at]);
        out[crc_at..].copy_from_slice(&crc.to_le_bytes());
    }

    fn put_statistics(&self, record: &mut Vec<u8>) {
        record.put_u64_le(self.messages.values().sum());
        record.put_u16_le(self.schemas.count as u16);
        record.put_u32_le(self.channels.count);
        record.put_u32_le(self.attachments.count);
        record.put_u32_le(self.metadata.count);
        record.put_u32_le(self.chunks.count);
        self.span_ns.put(record);
        put_sized(record, |map| {
            for (channel, count) in &self.messages {
                map.put_u16_le(*channel);
                map.put_u64_le(*count);
            }
        });
    }
}
