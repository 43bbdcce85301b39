//! Limits of the memory that the content of a file may take.

use std::io::Read;

use crate::bytes::Bytes;
use crate::error::ArraysError;

/// What a variable takes beside its numbers: name, shape, place in a list.
const VARIABLE_BYTES: u64 = 128;

/// Bytes that may still be taken.
pub(crate) struct Budget {
    limit: u64,
    numbers: u64,
    unpacked: u64,
}

impl Budget {
    pub fn new(limit: u64) -> Budget {
        Budget {
            limit,
            numbers: limit,
            unpacked: limit,
        }
    }

    /// Takes a variable with so many numbers of this size.
    pub fn take(&mut self, count: usize, bytes_each: u64) -> Result<(), ArraysError> {
        let bytes = (count as u64).checked_mul(bytes_each);
        let bytes = bytes.and_then(|bytes| bytes.checked_add(VARIABLE_BYTES));
        let left = bytes.and_then(|bytes| self.numbers.checked_sub(bytes));
        self.numbers = left.ok_or(ArraysError::TooLarge { limit: self.limit })?;
        Ok(())
    }

    /// Takes so many unpacked bytes.
    pub fn take_unpacked(&mut self, bytes: u64) -> Result<(), ArraysError> {
        let left = self.unpacked.checked_sub(bytes);
        self.unpacked = left.ok_or(ArraysError::TooLarge { limit: self.limit })?;
        Ok(())
    }

    /// All bytes of a packed part at a place in the file.
    pub fn unpack(
        &mut self,
        packed: impl Read,
        place: &Bytes<'_>,
        what: &'static str,
    ) -> Result<Vec<u8>, ArraysError> {
        let mut unpacked = Vec::new();
        let read = packed.take(self.unpacked + 1).read_to_end(&mut unpacked);
        read.map_err(|_| place.damaged(what))?;
        self.take_unpacked(unpacked.len() as u64)?;
        Ok(unpacked)
    }
}
