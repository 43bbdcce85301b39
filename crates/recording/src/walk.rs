//! Reads a file record by record, up to its end or its first damage.
//!
//! The options of `mcap` select these checks: the CRC from the start of the file to the end of the data section, the CRC of the
//! summary, and the magic bytes at both ends. [`super::contents`] checks the records.

use std::fs::File;
use std::io::{self, Read};

use mcap::McapError;
use mcap::sans_io::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::contents::{Contents, Take};
use super::error;

/// Bytes that are read at a time.
const READ_BYTES: usize = 64 << 10;
/// Largest record. A larger length is damaged, and no memory is allocated for it.
pub(super) const RECORD_BYTES: usize = 256 << 20;

/// Why a walk ended before the end of a complete file.
pub(super) enum Stop {
    /// The file ends early.
    Cut,
    /// The content is damaged.
    Damaged(String),
    /// It is not an MCAP file.
    NotMcap,
    /// It cannot be read.
    Read(io::Error),
}

/// A walk through one file.
pub(super) struct Walk {
    file: File,
    reader: LinearReader,
    bytes_read: u64,
    /// Start of the current record.
    pub(super) offset: u64,
    pub(super) contents: Contents,
}

impl Walk {
    pub(super) fn new(file: File) -> Walk {
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_check_finishes_after_end_magic(true)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true)
            .with_record_length_limit(RECORD_BYTES);
        let reader = LinearReader::new_with_options(options);
        Walk {
            file,
            reader,
            bytes_read: 0,
            offset: 0,
            contents: Contents::default(),
        }
    }

    /// Reads one record (a whole chunk at a time); `false` at the end of a complete file.
    pub(super) fn step(&mut self, take: &mut Take) -> Result<bool, Stop> {
        while let Some(event) = self.reader.next_event() {
            match event {
                Ok(LinearReadEvent::ReadRequest(need)) => self.fill(need)?,
                Ok(LinearReadEvent::Record { opcode, data }) => {
                    let next = self.offset.max(mcap::MAGIC.len() as u64) + 9 + data.len() as u64;
                    self.contents
                        .record(opcode, data, take)
                        .map_err(Stop::Damaged)?;
                    self.offset = next;
                    return Ok(true);
                }
                Err(e) => return Err(self.stop(e)),
            }
        }
        if self.contents.data_ended {
            Ok(false)
        } else {
            Err(Stop::Damaged(
                "the end of the data section is missing".into(),
            ))
        }
    }

    fn fill(&mut self, need: usize) -> Result<(), Stop> {
        let buffer = self.reader.insert(need.clamp(READ_BYTES, 16 * READ_BYTES));
        let read = loop {
            match self.file.read(buffer) {
                Err(e) if e.kind() == io::ErrorKind::Interrupted => {}
                other => break other.map_err(Stop::Read)?,
            }
        };
        self.reader.notify_read(read);
        self.bytes_read += read as u64;
        Ok(())
    }

    fn stop(&self, error: McapError) -> Stop {
        match error {
            McapError::UnexpectedEof if self.bytes_read < mcap::MAGIC.len() as u64 => Stop::NotMcap,
            McapError::UnexpectedEof => Stop::Cut,
            McapError::BadMagic if self.offset == 0 => Stop::NotMcap,
            McapError::BadMagic => Stop::Damaged(
                "the footer or the magic at the end of the MCAP file is missing".into(),
            ),
            McapError::BytesAfterEndMagic => {
                Stop::Damaged("the file goes on after the end of the recording".into())
            }
            other => Stop::Damaged(error::why(&other)),
        }
    }
}
