//! Service data objects (CiA 301, 7.2.4.3): reading and writing the object dictionary of a node.
//!
//! ```text
//! 0x600 + node   request, 8 bytes       0x580 + node   answer, 8 bytes        [command][index LE][sub][4 bytes]
//!
//!                       request                            answer
//! download initiate     001 0 nn e s  index sub data       011 00000  index sub
//! download segment      000 t nnn c   7 bytes              001 t 0000
//! upload initiate       010 00000     index sub            010 0 nn e s  index sub data
//! upload segment        011 t 0000                         000 t nnn c   7 bytes
//! abort                 100 00000     index sub code LE    the same
//!
//! e expedited, s size indicated, n unused bytes (of 4 or of 7), t toggles from 0, c last segment
//! ```
//!
//! An expedited transfer has up to 4 bytes in the first frame; longer data follow in segments. Block transfer is not used: the
//! server aborts it.

mod abort;
mod channel;
mod client;
mod server;

pub use abort::AbortCode;
pub use channel::{Channel, SdoError};
pub use client::{Client, Failure, Progress};
pub use server::{Dictionary, Server};

use super::frame::Id;

/// Identifier of requests to `node`.
pub const fn request_id(node: u8) -> Id {
    Id::standard(0x600 + (node & 0x7F) as u16)
}

/// Identifier of answers from `node`.
pub const fn answer_id(node: u8) -> Id {
    Id::standard(0x580 + (node & 0x7F) as u16)
}

/// Address of an object in the object dictionary.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Address {
    /// Index, 0x0000 to 0xFFFF.
    pub index: u16,
    /// Sub-index.
    pub sub: u8,
}

impl Address {
    /// Index and sub-index.
    pub const fn new(index: u16, sub: u8) -> Address {
        Address { index, sub }
    }
}

impl std::fmt::Display for Address {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "0x{:04X}:{:02X}", self.index, self.sub)
    }
}

/// Up to seven bytes of a transfer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Part {
    bytes: [u8; 7],
    length: u8,
}

impl Part {
    /// The first bytes of `bytes`, at most seven.
    pub fn new(bytes: &[u8]) -> Part {
        let length = bytes.len().min(7);
        let mut part = Part {
            bytes: [0; 7],
            length: length as u8,
        };
        part.bytes[..length].copy_from_slice(&bytes[..length]);
        part
    }

    /// The bytes.
    pub fn bytes(&self) -> &[u8] {
        self.bytes
            .get(..usize::from(self.length))
            .unwrap_or(&self.bytes)
    }
}

/// The start of a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// Expedited: all data, 1 to 4 bytes.
    Expedited(Part),
    /// Segments follow; the size in bytes, if it is indicated.
    Segmented(Option<u32>),
}

/// A request of the client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// Starts writing.
    Download(Address, Start),
    /// Writes the next segment.
    DownloadSegment {
        /// The toggle bit; it alternates and starts with false.
        toggle: bool,
        /// Whether this is the last segment.
        last: bool,
        /// The data.
        part: Part,
    },
    /// Starts reading.
    Upload(Address),
    /// Reads the next segment.
    UploadSegment {
        /// The toggle bit; it alternates and starts with false.
        toggle: bool,
    },
    /// Aborts the transfer.
    Abort(Address, AbortCode),
}

/// An answer of the server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// Writing has started; an expedited transfer is complete.
    Downloaded(Address),
    /// A segment was received.
    DownloadedSegment {
        /// The toggle bit of the request.
        toggle: bool,
    },
    /// Reading has started; an expedited transfer is complete.
    Uploaded(Address, Start),
    /// A segment.
    UploadedSegment {
        /// The toggle bit of the request.
        toggle: bool,
        /// Whether this is the last segment.
        last: bool,
        /// The data.
        part: Part,
    },
    /// Aborts the transfer.
    Abort(Address, AbortCode),
}

fn initiate(command: u8, address: Address, data: [u8; 4]) -> [u8; 8] {
    let [low, high] = address.index.to_le_bytes();
    [
        command,
        low,
        high,
        address.sub,
        data[0],
        data[1],
        data[2],
        data[3],
    ]
}

fn address_of(frame: [u8; 8]) -> Address {
    Address {
        index: u16::from_le_bytes([frame[1], frame[2]]),
        sub: frame[3],
    }
}

fn word_of(frame: [u8; 8]) -> u32 {
    u32::from_le_bytes([frame[4], frame[5], frame[6], frame[7]])
}

/// Encodes the start of a transfer; `specifier` has the command bits 7 to 5. An expedited part has 1 to 4 bytes.
fn encode_start(specifier: u8, address: Address, start: Start) -> [u8; 8] {
    match start {
        Start::Expedited(part) => {
            let length = part.bytes().len().clamp(1, 4) as u8;
            let mut data = [0; 4];
            data.copy_from_slice(&part.bytes[..4]);
            initiate(specifier | (4 - length) << 2 | 0b11, address, data)
        }
        Start::Segmented(Some(size)) => initiate(specifier | 0b01, address, size.to_le_bytes()),
        Start::Segmented(None) => initiate(specifier, address, [0; 4]),
    }
}

fn decode_start(frame: [u8; 8]) -> Start {
    let (expedited, sized) = (frame[0] & 0b10 != 0, frame[0] & 0b01 != 0);
    let length = if sized {
        4 - usize::from(frame[0] >> 2 & 0b11)
    } else {
        4
    };
    match (expedited, sized) {
        (true, _) => Start::Expedited(Part::new(&frame[4..4 + length])),
        (false, true) => Start::Segmented(Some(word_of(frame))),
        (false, false) => Start::Segmented(None),
    }
}

fn encode_segment(toggle: bool, last: bool, part: Part) -> [u8; 8] {
    let mut frame = [0; 8];
    frame[0] = u8::from(toggle) << 4 | (7 - part.bytes().len() as u8) << 1 | u8::from(last);
    frame[1..].copy_from_slice(&part.bytes);
    frame
}

fn decode_segment(frame: [u8; 8]) -> (bool, bool, Part) {
    let length = 7 - usize::from(frame[0] >> 1 & 0b111);
    (
        toggle_of(frame),
        frame[0] & 1 != 0,
        Part::new(&frame[1..1 + length]),
    )
}

fn toggle_of(frame: [u8; 8]) -> bool {
    frame[0] & 0x10 != 0
}

impl Request {
    /// The eight bytes.
    pub fn encode(&self) -> [u8; 8] {
        match *self {
            Request::Download(address, start) => encode_start(1 << 5, address, start),
            Request::DownloadSegment { toggle, last, part } => encode_segment(toggle, last, part),
            Request::Upload(address) => initiate(2 << 5, address, [0; 4]),
            Request::UploadSegment { toggle } => {
                initiate(3 << 5 | u8::from(toggle) << 4, Address::new(0, 0), [0; 4])
            }
            Request::Abort(address, code) => initiate(4 << 5, address, code.0.to_le_bytes()),
        }
    }

    /// Decodes eight bytes; `None` if there are not eight or the command is unknown (block transfer, 7).
    pub fn decode(data: &[u8]) -> Option<Request> {
        let frame: [u8; 8] = data.try_into().ok()?;
        let (toggle, last, part) = decode_segment(frame);
        match frame[0] >> 5 {
            0 => Some(Request::DownloadSegment { toggle, last, part }),
            1 => Some(Request::Download(address_of(frame), decode_start(frame))),
            2 => Some(Request::Upload(address_of(frame))),
            3 => Some(Request::UploadSegment { toggle }),
            4 => Some(Request::Abort(address_of(frame), AbortCode(word_of(frame)))),
            _ => None,
        }
    }
}

impl Answer {
    /// The eight bytes.
    pub fn encode(&self) -> [u8; 8] {
        match *self {
            Answer::UploadedSegment { toggle, last, part } => encode_segment(toggle, last, part),
            Answer::DownloadedSegment { toggle } => {
                initiate(1 << 5 | u8::from(toggle) << 4, Address::new(0, 0), [0; 4])
            }
            Answer::Uploaded(address, start) => encode_start(2 << 5, address, start),
            Answer::Downloaded(address) => initiate(3 << 5, address, [0; 4]),
            Answer::Abort(address, code) => initiate(4 << 5, address, code.0.to_le_bytes()),
        }
    }

    /// Decodes eight bytes; `None` if there are not eight or the command is unknown.
    pub fn decode(data: &[u8]) -> Option<Answer> {
        let frame: [u8; 8] = data.try_into().ok()?;
        let (toggle, last, part) = decode_segment(frame);
        match frame[0] >> 5 {
            0 => Some(Answer::UploadedSegment { toggle, last, part }),
            1 => Some(Answer::DownloadedSegment { toggle }),
            2 => Some(Answer::Uploaded(address_of(frame), decode_start(frame))),
            3 => Some(Answer::Downloaded(address_of(frame))),
            4 => Some(Answer::Abort(address_of(frame), AbortCode(word_of(frame)))),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests;
