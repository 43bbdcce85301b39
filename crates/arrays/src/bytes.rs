//! Bytes of a file with a place in them.

use crate::error::ArraysError;

/// Order of the bytes of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ByteOrder {
    Little,
    Big,
}

impl ByteOrder {
    /// The bits of up to eight bytes as an unsigned number.
    pub fn bits(self, bytes: &[u8]) -> u64 {
        let append = |bits: u64, byte: &u8| bits << 8 | u64::from(*byte);
        match self {
            ByteOrder::Little => bytes.iter().rev().fold(0, append),
            ByteOrder::Big => bytes.iter().fold(0, append),
        }
    }
}

/// Where bytes come from.
#[derive(Clone, Copy)]
enum Origin {
    /// The file itself, from this offset on.
    File(usize),
    /// A packed part at this offset.
    Packed(usize),
}

/// Bytes that are read from their beginning to their end.
#[derive(Clone, Copy)]
pub(crate) struct Bytes<'a> {
    bytes: &'a [u8],
    at: usize,
    origin: Origin,
    pub order: ByteOrder,
}

impl<'a> Bytes<'a> {
    pub fn new(bytes: &'a [u8], order: ByteOrder) -> Bytes<'a> {
        Bytes {
            bytes,
            at: 0,
            origin: Origin::File(0),
            order,
        }
    }

    /// Unpacked bytes of the part that begins here.
    pub fn unpacked<'b>(&self, bytes: &'b [u8]) -> Bytes<'b> {
        Bytes {
            bytes,
            at: 0,
            origin: Origin::Packed(self.offset()),
            order: self.order,
        }
    }

    /// Offset in the file.
    pub fn offset(&self) -> usize {
        match self.origin {
            Origin::File(start) => start + self.at,
            Origin::Packed(start) => start,
        }
    }

    pub fn is_empty(&self) -> bool {
        self.at >= self.bytes.len()
    }

    /// The bytes that are left.
    pub fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// The next bytes; `what` names them.
    pub fn take(&mut self, count: usize, what: &'static str) -> Result<&'a [u8], ArraysError> {
        let part = self.rest().get(..count);
        let part = part.ok_or_else(|| self.damaged(what))?;
        self.at += count;
        Ok(part)
    }

    /// The next bytes as a part of its own.
    pub fn part(&mut self, count: usize, what: &'static str) -> Result<Bytes<'a>, ArraysError> {
        let start = self.offset();
        let bytes = self.take(count, what)?;
        let origin = match self.origin {
            Origin::File(_) => Origin::File(start),
            packed @ Origin::Packed(_) => packed,
        };
        Ok(Bytes {
            bytes,
            at: 0,
            origin,
            order: self.order,
        })
    }

    /// The next bytes as an unsigned number.
    pub fn unsigned(&mut self, count: usize, what: &'static str) -> Result<u64, ArraysError> {
        Ok(self.order.bits(self.take(count, what)?))
    }

    /// Skips to a multiple of eight bytes from the beginning; at the end of the bytes there may be less.
    pub fn align(&mut self) {
        self.at = self.at.next_multiple_of(8).min(self.bytes.len());
    }

    /// The next line without its end; `None` at the end of the bytes.
    pub fn line(&mut self) -> Option<&'a [u8]> {
        let rest = self.rest();
        if rest.is_empty() {
            return None;
        }
        let end = rest.iter().position(|byte| *byte == b'\n');
        self.at += end.map_or(rest.len(), |end| end + 1);
        let line = &rest[..end.unwrap_or(rest.len())];
        Some(line.strip_suffix(b"\r").unwrap_or(line))
    }

    /// The error of a part that is not what it should be.
    pub fn damaged(&self, what: &'static str) -> ArraysError {
        ArraysError::Damaged {
            variable: None,
            at: self.offset() as u64,
            what,
        }
    }
}
