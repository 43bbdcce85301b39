//! Emergency messages (CiA 301, 7.2.7; codes of drives: CiA 402-2).
//!
//! ```text
//! 0x080 + node   [code u16 LE, error register u8, 5 bytes of the vendor]      code 0x0000: the error is removed
//! ```

use super::frame::{CanFrame, Id};

/// An emergency message.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Emergency {
    /// The code, see [`text`]; 0 means that the error is removed.
    pub code: u16,
    /// Object 0x1001, see [`register_names`].
    pub register: u8,
    /// Manufacturer-specific error code (5 bytes), described in the manual of the drive.
    pub vendor: [u8; 5],
}

/// Identifier of the emergencies of `node` (1 to 127).
pub const fn cob_id(node: u8) -> Id {
    Id::standard(0x080 + (node & 0x7F) as u16)
}

impl Emergency {
    /// The CAN frame of this emergency message, sent by `node`.
    pub const fn frame(&self, node: u8) -> CanFrame {
        let [low, high] = self.code.to_le_bytes();
        let v = self.vendor;
        CanFrame::new(
            cob_id(node),
            [low, high, self.register, v[0], v[1], v[2], v[3], v[4]],
        )
    }

    /// Decodes the eight bytes.
    pub fn decode(data: &[u8]) -> Option<Emergency> {
        let &[low, high, register, a, b, c, d, e] = data else {
            return None;
        };
        Some(Emergency {
            code: u16::from_le_bytes([low, high]),
            register,
            vendor: [a, b, c, d, e],
        })
    }
}

/// First and last code, and the meaning: the codes that CiA 301 or CiA 402 define.
#[rustfmt::skip]
const CODES: [(u16, u16, &str); 26] = [
    (0x0000, 0x0000, "no error, or the error is removed"),
    (0x2310, 0x2312, "continuous over-current at the output"),
    (0x2320, 0x2320, "short circuit or earth leakage at the output"),
    (0x2321, 0x2321, "short circuit or earth leakage at the output"),
    (0x2330, 0x2330, "short circuit or earth leakage at the output"),
    (0x3110, 0x3110, "supply or link voltage too high"),
    (0x3210, 0x3210, "supply or link voltage too high"),
    (0x3120, 0x3120, "supply or link voltage too low"),
    (0x3220, 0x3220, "supply or link voltage too low"),
    (0x4210, 0x4210, "drive too hot"),
    (0x4310, 0x4310, "drive too hot (excess temperature)"),
    (0x5441, 0x5443, "a contact or enable input is open"),
    (0x7121, 0x7121, "motor blocked"),
    (0x7300, 0x73FF, "sensor of the drive failed"),
    (0x8110, 0x8110, "CAN overrun: frames lost"),
    (0x8120, 0x8120, "CAN error passive"),
    (0x8130, 0x8130, "heartbeat or life guard lost: the drive no longer received that of its master"),
    (0x8140, 0x8140, "recovered from bus-off"),
    (0x8150, 0x8150, "COB-ID collision"),
    (0x8210, 0x8210, "PDO not processed: wrong length"),
    (0x8220, 0x8220, "PDO longer than mapped"),
    (0x8240, 0x8240, "unexpected SYNC length"),
    (0x8250, 0x8250, "RPDO timed out"),
    (0x8311, 0x8311, "excess torque"),
    (0x8400, 0x84FF, "speed out of bounds"),
    (0x8500, 0x87FF, "following error"),
];

/// First and last upper byte of the code, and its class (CiA 301, table 26).
#[rustfmt::skip]
const CLASSES: [(u16, u16, &str); 29] = [
    (0x00, 0x00, "no error, or the error is removed"),
    (0x10, 0x1F, "generic error"),
    (0x20, 0x20, "current"),
    (0x21, 0x21, "current at the input of the drive"),
    (0x22, 0x22, "current inside the drive"),
    (0x23, 0x23, "current at the output of the drive"),
    (0x24, 0x2F, "current"),
    (0x30, 0x30, "voltage"),
    (0x31, 0x31, "mains voltage"),
    (0x32, 0x32, "voltage inside the drive"),
    (0x33, 0x33, "output voltage"),
    (0x34, 0x3F, "voltage"),
    (0x40, 0x40, "temperature"),
    (0x41, 0x41, "ambient temperature"),
    (0x42, 0x4F, "temperature of the drive"),
    (0x50, 0x5F, "hardware of the drive"),
    (0x60, 0x60, "software of the drive"),
    (0x61, 0x61, "internal software of the drive"),
    (0x62, 0x62, "user software of the drive"),
    (0x63, 0x63, "data set of the drive"),
    (0x64, 0x6F, "software of the drive"),
    (0x70, 0x7F, "additional module of the drive"),
    (0x80, 0x80, "monitoring"),
    (0x81, 0x81, "communication"),
    (0x82, 0x82, "protocol"),
    (0x83, 0x8F, "monitoring"),
    (0x90, 0x9F, "external error"),
    (0xF0, 0xFE, "additional function of the drive"),
    (0xFF, 0xFF, "specific to the drive"),
];

/// The meaning of an error code, or else its class.
pub fn text(code: u16) -> &'static str {
    find(&CODES, code)
        .or(find(&CLASSES, code >> 8))
        .unwrap_or("reserved code")
}

fn find(table: &[(u16, u16, &'static str)], number: u16) -> Option<&'static str> {
    let entry = table
        .iter()
        .find(|(first, last, _)| (*first..=*last).contains(&number));
    entry.map(|(.., text)| *text)
}

/// The names of the set bits of the error register (object 0x1001).
pub fn register_names(register: u8) -> impl Iterator<Item = &'static str> {
    const NAMES: [&str; 8] = [
        "generic",
        "current",
        "voltage",
        "temperature",
        "communication",
        "device profile",
        "reserved",
        "manufacturer",
    ];
    NAMES
        .into_iter()
        .enumerate()
        .filter(move |(bit, _)| register >> bit & 1 == 1)
        .map(|(_, name)| name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn emergency_contains_code_register_and_vendor_bytes() {
        // The bytes for over-current at the output of node 5, error register generic + current.
        let emergency = Emergency {
            code: 0x2310,
            register: 0x03,
            vendor: [1, 2, 3, 4, 5],
        };
        let frame = emergency.frame(5);
        assert_eq!(
            (frame.id(), frame.data()),
            (Id::standard(0x085), &[0x10, 0x23, 3, 1, 2, 3, 4, 5][..])
        );
        assert_eq!(Emergency::decode(frame.data()), Some(emergency));
        assert_eq!(Emergency::decode(&frame.data()[..7]), None);
    }

    #[test]
    fn every_code_has_a_text() {
        assert_eq!(
            text(0x8130),
            "heartbeat or life guard lost: the drive no longer received that of its master"
        );
        assert_eq!(text(0x4299), "temperature of the drive");
        assert_eq!(text(0xFF12), "specific to the drive");
        assert!((0..=u16::MAX).all(|code| !text(code).is_empty()));
        assert_eq!(
            register_names(0b1000_0011).collect::<Vec<_>>(),
            ["generic", "current", "manufacturer"]
        );
    }
}
