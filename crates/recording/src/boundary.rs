//! Where a recording ends in a file that may hold several of them, one after the other.
//!
//! A recording begins with the magic and a header. The same bytes may also be the content of a record, for example of an attachment
//! that is a recording itself. They are content if the record
//!
//! * has a CRC that holds, or
//! * is damaged, but another record follows where its length ends. A record that is cut off has a length too, which ends somewhere in
//!   the recordings behind it. If it happens to end where a record of one of those begins, the bytes are a start all the same.
//!
//! A recording that is complete ends with its footer and the magic. One that is cut off ends where the next one begins. If it is cut off
//! within an attachment that is a recording, that recording is therefore taken for the next one: nothing of it is lost.

use std::io;

use mcap::MAGIC;
use mcap::records::op;

use super::contents::{is_intact, is_length_confirmed};
use super::file_range::{FileRange, RecordHead, RecordingEnd};

/// End of the recording at the start of `range`.
pub(super) fn end_of_recording(range: &FileRange) -> io::Result<RecordingEnd> {
    let has_magic = range.has_magic_at(0);
    let mut walk = BoundaryWalk {
        range,
        offset: range.first_record()?,
        before: None,
        search_from: if has_magic { MAGIC.len() as u64 } else { 0 },
        limit: range.bytes,
    };
    walk.limit_to_start_after(walk.search_from)?;
    walk.find_end()
}

/// Start of the first recording behind the one at the start of `range`.
pub(super) fn next_recording(range: &FileRange) -> io::Result<Option<u64>> {
    range.next_start(end_of_recording(range)?.bytes, range.bytes)
}

/// Hops from record to record, without reading their contents.
struct BoundaryWalk<'a> {
    range: &'a FileRange,
    offset: u64,
    /// The record before `offset`; `None` after a damage.
    before: Option<RecordHead>,
    /// Where the search after a damage begins at the earliest.
    search_from: u64,
    /// The next position at which a recording may begin, or the end.
    limit: u64,
}

impl BoundaryWalk<'_> {
    fn limit_to_start_after(&mut self, position: u64) -> io::Result<()> {
        let start = self.range.next_start(position, self.range.bytes)?;
        self.limit = start.unwrap_or(self.range.bytes);
        Ok(())
    }

    fn find_end(&mut self) -> io::Result<RecordingEnd> {
        loop {
            match self.record_here()? {
                Some(head) if head.opcode == op::DATA_END => {
                    return Ok(RecordingEnd {
                        bytes: self.end_after_data(head.end())?,
                        summary_at: Some(head.end()),
                    });
                }
                Some(head) => self.advance(head),
                None if self.pass_over()? => {}
                None => {
                    return Ok(RecordingEnd {
                        bytes: self.limit,
                        summary_at: None,
                    });
                }
            }
        }
    }

    /// The record at `offset`, if it is one of this recording.
    fn record_here(&mut self) -> io::Result<Option<RecordHead>> {
        let head = self.range.head_at(self.offset)?;
        match head.filter(|_| self.offset < self.limit) {
            Some(head) if head.end() <= self.limit => Ok(Some(head)),
            Some(head) if self.is_content(head)? => {
                self.limit_to_start_after(head.end())?;
                Ok(Some(head))
            }
            _ => Ok(None),
        }
    }

    /// Continues with the next intact record; `false` if there is none.
    fn pass_over(&mut self) -> io::Result<bool> {
        let next = self.range.next_intact(self.resume_at()?, self.limit)?;
        if let Some(next) = next {
            self.before = None;
            self.offset = next;
            self.search_from = next + 1;
        }
        Ok(next.is_some())
    }

    fn advance(&mut self, head: RecordHead) {
        self.before = Some(head);
        self.offset = head.end();
    }

    /// Where to search after a damage: in the record before it as well, unless its length is confirmed.
    fn resume_at(&self) -> io::Result<u64> {
        let Some(before) = self.before else {
            return Ok(self.search_from);
        };
        let is_confirmed = is_length_confirmed(before.opcode, &self.range.data_of(before)?);
        let from = if is_confirmed {
            before.end()
        } else {
            before.start() + 1
        };
        Ok(from.max(self.search_from))
    }

    /// Whether what looks like a start at `limit` is the content of this record.
    fn is_content(&self, head: RecordHead) -> io::Result<bool> {
        if is_intact(head.opcode, &self.range.data_of(head)?) {
            return Ok(true);
        }
        if !self.range.is_plausible_at(head.end())? {
            return Ok(false);
        }
        let mut start = Some(self.limit);
        while let Some(position) = start {
            if self.leads_to(position, head.end())? {
                return Ok(false);
            }
            start = self.range.next_start(position + 1, head.end())?;
        }
        Ok(true)
    }

    /// Whether a record of the recording that begins at `start` begins at `position`.
    fn leads_to(&self, start: u64, position: u64) -> io::Result<bool> {
        let mut offset = start + MAGIC.len() as u64;
        while offset < position {
            match self.range.head_at(offset)? {
                Some(head) => offset = head.end(),
                None => return Ok(false),
            }
        }
        Ok(offset == position)
    }

    /// The end after the summary, the footer and the magic. With a damaged summary, it is where the next intact record or the
    /// next recording begins, because no record of a summary is found by [`FileRange::next_intact`].
    fn end_after_data(&self, data_end: u64) -> io::Result<u64> {
        let mut offset = data_end;
        while let Some(head) = self.range.any_head_at(offset)?
            && (op::HEADER..=op::DATA_END).contains(&head.opcode)
            && head.end() <= self.limit
        {
            offset = head.end();
            let end = offset + MAGIC.len() as u64;
            if head.opcode == op::FOOTER && end <= self.limit && self.range.has_magic_at(offset) {
                return Ok(end);
            }
        }
        let next = self.range.next_intact(data_end, self.limit)?;
        Ok(next.unwrap_or(self.limit))
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;
    use crate::{Header, Recorder};
    use bench_rt::record::{LoopMessage, TickRecord};

    /// A complete recording of 12 ticks in three chunks.
    fn recording() -> Vec<u8> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.mcap");
        let mut recorder = Recorder::create(&path, &Header::default()).expect("a fresh file");
        for tick in 0..12 {
            let record = TickRecord {
                tick,
                scheduled_ns: tick * 20_000_000,
                ..TickRecord::default()
            };
            recorder.record(&LoopMessage::Tick(record)).expect("room");
        }
        recorder
            .finish(&[("result", "text/plain", b"0")])
            .expect("room");
        std::fs::read(&path).expect("just written")
    }

    fn range(parts: &[&[u8]]) -> FileRange {
        let mut file = tempfile::tempfile().expect("a file");
        file.write_all(&parts.concat()).expect("room");
        FileRange::to_end(file, 0).expect("a file")
    }

    #[test]
    fn recording_cut_at_any_byte_ends_where_the_next_one_begins() {
        // The next recording is equal, so a record of it may begin where the length of the cut record ends.
        let recording = recording();
        for cut in 1..=recording.len() {
            let range = range(&[&recording[..cut], &recording]);
            let end = end_of_recording(&range).expect("readable").bytes;
            assert_eq!(end, cut as u64);
        }
    }

    #[test]
    fn recording_with_any_altered_byte_ends_where_the_next_one_begins() {
        let recording = recording();
        let mut altered = recording.clone();
        for at in 0..recording.len() {
            altered[at] ^= 1 << (at % 8);
            let range = range(&[&altered, &recording]);
            let end = end_of_recording(&range).expect("readable").bytes;
            assert_eq!(end, recording.len() as u64, "byte {at}");
            altered[at] = recording[at];
        }
    }

    /// A file with one chunk, not compressed, whose only message is `data`.
    fn chunk_with(data: &[u8]) -> Vec<u8> {
        let mut file = std::io::Cursor::new(Vec::new());
        let options = mcap::WriteOptions::new().compression(None);
        let mut writer = options.create(&mut file).expect("memory");
        let channel = writer.add_channel(0, "/raw", "", &Default::default());
        let header = mcap::records::MessageHeader {
            channel_id: channel.expect("memory"),
            sequence: 0,
            log_time: 0,
            publish_time: 0,
        };
        let written = writer.write_to_known_channel(&header, data);
        written.and_then(|()| writer.finish()).expect("memory");
        drop(writer);
        file.into_inner()
    }

    #[test]
    fn recording_inside_a_chunk_is_content() {
        let recording = recording();
        let whole = chunk_with(&recording);
        let at = |part: &[u8]| whole.windows(part.len()).position(|window| window == part);
        let mut altered = whole.clone();
        altered[at(&recording).expect("not compressed") + recording.len() / 2] ^= 1;
        for chunk in [whole, altered] {
            let range = range(&[&chunk, &recording]);
            let end = end_of_recording(&range).expect("readable").bytes;
            assert_eq!(end, chunk.len() as u64);
        }
    }

    #[test]
    fn start_across_two_search_blocks_is_found() {
        let recording = recording();
        for before in (1 << 20) - 9..(1 << 20) + 2 {
            let range = range(&[&vec![0; before], &recording]);
            let start = range.next_start(0, range.bytes).expect("readable");
            assert_eq!(start, Some(before as u64));
        }
    }
}
