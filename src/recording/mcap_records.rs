//! The encoding of the records of an MCAP file.

use bytes::BufMut;

/// First and last log time of messages in nanoseconds; 0 without messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct SpanNs(Option<(u64, u64)>);

impl SpanNs {
    pub(super) fn extend(&mut self, log_time_ns: u64) {
        let (first, last) = self.0.unwrap_or((log_time_ns, log_time_ns));
        self.0 = Some((first.min(log_time_ns), last.max(log_time_ns)));
    }

    pub(super) fn put(self, record: &mut Vec<u8>) {
        let (first, last) = self.0.unwrap_or_default();
        record.put_u64_le(first);
        record.put_u64_le(last);
    }
}

/// Appends a record: its kind, its length (u64) and its content.
pub(super) fn put_record(out: &mut Vec<u8>, opcode: u8, content: impl FnOnce(&mut Vec<u8>)) {
    out.put_u8(opcode);
    let start = out.len() + 8;
    out.put_u64_le(0);
    content(out);
    let length = (out.len() - start) as u64;
    out[start - 8..start].copy_from_slice(&length.to_le_bytes());
}

/// Appends content after its length (u32).
pub(super) fn put_sized(out: &mut Vec<u8>, content: impl FnOnce(&mut Vec<u8>)) {
    let start = out.len() + 4;
    out.put_u32_le(0);
    content(out);
    let length = (out.len() - start) as u32;
    out[start - 4..start].copy_from_slice(&length.to_le_bytes());
}

/// Appends a text after its length (u32).
pub(super) fn put_text(out: &mut Vec<u8>, text: &str) {
    put_sized(out, |out| out.put_slice(text.as_bytes()));
}
