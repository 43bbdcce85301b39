//! Numbers in a slice of bytes, without a read beyond its end.

use crate::import_error::FormatError;

/// A position in bytes of one byte order.
#[derive(Clone, Debug)]
pub(super) struct Bytes<'a> {
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
}

impl<'a> Bytes<'a> {
    pub fn new(bytes: &'a [u8], big_endian: bool) -> Self {
        Bytes {
            bytes,
            at: 0,
            big_endian,
        }
    }

    /// Whether all bytes were read.
    pub fn is_empty(&self) -> bool {
        self.at >= self.bytes.len()
    }

    /// Whether the byte order is big endian.
    pub fn is_big_endian(&self) -> bool {
        self.big_endian
    }

    /// The next `count` bytes.
    pub fn take(&mut self, count: usize, what: &'static str) -> Result<&'a [u8], FormatError> {
        let end = self.at.checked_add(count);
        let part = end.and_then(|end| self.bytes.get(self.at..end));
        let part = part.ok_or_else(|| self.damaged(what))?;
        self.at += count;
        Ok(part)
    }

    /// The next number.
    pub fn u32(&mut self, what: &'static str) -> Result<u32, FormatError> {
        let part = self.take(4, what)?;
        Ok(unsigned(part, self.big_endian) as u32)
    }

    /// Skips to the next multiple of 8, or to the end.
    pub fn align(&mut self) {
        self.at = self.at.next_multiple_of(8).min(self.bytes.len());
    }

    /// An error at this place.
    pub fn damaged(&self, what: &'static str) -> FormatError {
        FormatError::Damaged { at: self.at, what }
    }
}

/// An unsigned integer of up to eight bytes.
pub(super) fn unsigned(bytes: &[u8], big_endian: bool) -> u64 {
    let append = |number: u64, byte: &u8| number << 8 | u64::from(*byte);
    if big_endian {
        bytes.iter().fold(0, append)
    } else {
        bytes.iter().rev().fold(0, append)
    }
}

/// A signed integer of up to eight bytes.
pub(super) fn signed(bytes: &[u8], big_endian: bool) -> i64 {
    let unused_bits = 64 - 8 * bytes.len().clamp(1, 8) as u32;
    ((unsigned(bytes, big_endian) << unused_bits) as i64) >> unused_bits
}

/// A number of single (four bytes) or double precision.
pub(super) fn float(bytes: &[u8], big_endian: bool) -> f64 {
    let bits = unsigned(bytes, big_endian);
    match bytes.len() {
        4 => f64::from(f32::from_bits(bits as u32)),
        _ => f64::from_bits(bits),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_both_byte_orders() {
        assert_eq!(unsigned(&[1, 2], false), 0x0201);
        assert_eq!(unsigned(&[1, 2], true), 0x0102);
        assert_eq!(signed(&[0xfe, 0xff], false), -2);
        assert_eq!(signed(&[0x7f], false), 127);
        assert_eq!(float(&1.5f32.to_be_bytes(), true), 1.5);
        assert_eq!(float(&(-0.1f64).to_le_bytes(), false), -0.1);
    }

    #[test]
    fn nothing_is_read_beyond_the_end() {
        let mut bytes = Bytes::new(&[1, 0, 0, 0, 2], false);
        assert_eq!(bytes.u32("a number"), Ok(1));
        assert!(bytes.u32("a number").is_err());
        assert!(bytes.take(usize::MAX, "a size").is_err());
        bytes.align();
        assert!(bytes.is_empty());
    }
}
