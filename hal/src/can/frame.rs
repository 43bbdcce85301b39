//! A CAN frame, independent of sockets.

/// A CAN identifier: 11 bits (base format) or 29 bits (extended format).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Id {
    raw: u32,
    extended: bool,
}

impl Id {
    /// An 11-bit identifier; higher bits are ignored.
    pub const fn standard(raw: u16) -> Id {
        Id {
            raw: raw as u32 & 0x7FF,
            extended: false,
        }
    }

    /// A 29-bit identifier; higher bits are ignored.
    pub const fn extended(raw: u32) -> Id {
        Id {
            raw: raw & 0x1FFF_FFFF,
            extended: true,
        }
    }

    /// The number without the format.
    pub const fn raw(self) -> u32 {
        self.raw
    }

    /// Whether the identifier has 29 bits.
    pub const fn is_extended(self) -> bool {
        self.extended
    }
}

/// A data frame of classical CAN: identifier and 0 to 8 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct CanFrame {
    id: Id,
    length: u8,
    data: [u8; 8],
}

impl CanFrame {
    /// A frame of `N` bytes, at most eight; this is checked at compile time.
    pub const fn new<const N: usize>(id: Id, bytes: [u8; N]) -> CanFrame {
        const { assert!(N <= 8, "a CAN frame has at most eight bytes") };
        let mut data = [0; 8];
        let mut at = 0;
        while at < N {
            data[at] = bytes[at];
            at += 1;
        }
        CanFrame {
            id,
            length: N as u8,
            data,
        }
    }

    /// A frame with `bytes`; `None` if there are more than eight.
    pub fn from_slice(id: Id, bytes: &[u8]) -> Option<CanFrame> {
        let mut data = [0; 8];
        data.get_mut(..bytes.len())?.copy_from_slice(bytes);
        Some(CanFrame {
            id,
            length: bytes.len() as u8,
            data,
        })
    }

    /// The identifier.
    pub const fn id(&self) -> Id {
        self.id
    }

    /// The bytes.
    pub fn data(&self) -> &[u8] {
        self.data
            .get(..usize::from(self.length))
            .unwrap_or(&self.data)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn identifiers_preserve_their_format() {
        assert_eq!(Id::standard(0xFFFF).raw(), 0x7FF);
        assert_eq!(Id::extended(u32::MAX).raw(), 0x1FFF_FFFF);
        assert_ne!(
            Id::standard(0x17),
            Id::extended(0x17),
            "the same number in another format is another identifier"
        );
    }

    #[test]
    fn a_frame_holds_up_to_eight_bytes() {
        let id = Id::standard(1);
        assert_eq!(CanFrame::new(id, [1, 2, 3]).data(), [1, 2, 3]);
        assert_eq!(
            CanFrame::from_slice(id, &[7; 8]).map(|frame| frame.data().len()),
            Some(8)
        );
        assert_eq!(CanFrame::from_slice(id, &[7; 9]), None);
    }
}
