//! Sections of a file that are written at the same time.

use std::fs::File;
use std::os::unix::fs::FileExt;

use super::ExportError;

/// Bytes of a section that are written at once.
const BLOCK: usize = 1 << 18;

/// The sections of a file, one behind the other. Their lengths are known before they are written, so that the columns of a table,
/// each in a section of its own, are written in one pass over the rows.
pub(super) struct Sections<'a> {
    file: &'a File,
    sections: Vec<Section>,
}

struct Section {
    /// Where the next block is written.
    offset: u64,
    end: u64,
    block: Vec<u8>,
}

impl<'a> Sections<'a> {
    /// Sections with these lengths in bytes, from the start of the file.
    pub(super) fn new(file: &'a File, lengths: impl IntoIterator<Item = u64>) -> Sections<'a> {
        let mut offset = 0;
        let section = |length: u64| {
            let section = Section {
                offset,
                end: offset + length,
                block: Vec::with_capacity(BLOCK),
            };
            offset = section.end;
            section
        };
        Sections {
            file,
            sections: lengths.into_iter().map(section).collect(),
        }
    }

    /// Appends bytes to a section. Fails if it becomes longer than its length.
    pub(super) fn append(&mut self, index: usize, bytes: &[u8]) -> Result<(), ExportError> {
        let section = &mut self.sections[index];
        section.block.extend_from_slice(bytes);
        if section.block.len() < BLOCK {
            Ok(())
        } else {
            section.write_block(self.file)
        }
    }

    /// Writes what is left. Fails if a section is shorter than its length.
    pub(super) fn finish(mut self) -> Result<(), ExportError> {
        for section in &mut self.sections {
            section.write_block(self.file)?;
            if section.offset != section.end {
                return Err(ExportError::Changed);
            }
        }
        Ok(())
    }
}

impl Section {
    fn write_block(&mut self, file: &File) -> Result<(), ExportError> {
        let end = self.offset + self.block.len() as u64;
        if end > self.end {
            return Err(ExportError::Changed);
        }
        file.write_all_at(&self.block, self.offset)?;
        self.offset = end;
        self.block.clear();
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sections_are_contiguous_and_have_their_lengths() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        let mut sections = Sections::new(file.as_file(), [3, 2 * BLOCK as u64, 1]);
        for _ in 0..BLOCK {
            sections.append(1, b"bb").expect("written");
        }
        sections.append(2, b"c").expect("written");
        sections.append(0, b"aaa").expect("written");
        sections.finish().expect("complete");
        let bytes = std::fs::read(file.path()).expect("read");
        let expected = ["aaa".into(), "b".repeat(2 * BLOCK), "c".into()].concat();
        assert!(bytes == expected.as_bytes());
    }

    #[test]
    fn rejects_a_section_that_is_too_short_or_too_long() {
        for bytes in [&b"a"[..], b"aaa"] {
            let file = tempfile::NamedTempFile::new().expect("a file");
            let mut sections = Sections::new(file.as_file(), [2]);
            let appended = sections.append(0, bytes);
            let finished = appended.and_then(|()| sections.finish());
            assert!(matches!(finished, Err(ExportError::Changed)));
        }
    }
}
