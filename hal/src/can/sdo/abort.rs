//! Abort codes (CiA 301, table 22) and their text.

use std::fmt;

/// The reason why one side aborted a transfer.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct AbortCode(pub u32);

impl AbortCode {
    /// Toggle bit not alternated.
    pub const TOGGLE: AbortCode = AbortCode(0x0503_0000);
    /// Timed out.
    pub const TIMEOUT: AbortCode = AbortCode(0x0504_0000);
    /// Command specifier unknown.
    pub const COMMAND: AbortCode = AbortCode(0x0504_0001);
    /// Out of memory.
    pub const MEMORY: AbortCode = AbortCode(0x0504_0005);
    /// Access not supported.
    pub const ACCESS: AbortCode = AbortCode(0x0601_0000);
    /// Write to a read-only object.
    pub const READ_ONLY: AbortCode = AbortCode(0x0601_0002);
    /// No such object.
    pub const NO_OBJECT: AbortCode = AbortCode(0x0602_0000);
    /// Object cannot be mapped.
    pub const NOT_MAPPABLE: AbortCode = AbortCode(0x0604_0041);
    /// Mapping longer than a PDO.
    pub const PDO_LENGTH: AbortCode = AbortCode(0x0604_0042);
    /// Length does not match.
    pub const LENGTH: AbortCode = AbortCode(0x0607_0010);
    /// No such sub-index.
    pub const NO_SUB_INDEX: AbortCode = AbortCode(0x0609_0011);
    /// Value out of range.
    pub const VALUE: AbortCode = AbortCode(0x0609_0030);
    /// Not in the present state of the device.
    pub const STATE: AbortCode = AbortCode(0x0800_0022);

    /// Whether the object does not exist: the node lacks an optional feature.
    pub fn means_absent(self) -> bool {
        self == AbortCode::NO_OBJECT || self == AbortCode::NO_SUB_INDEX
    }

    /// The meaning of the code.
    pub fn text(self) -> &'static str {
        let known = TEXTS.iter().find(|(code, _)| *code == self.0);
        known.map_or("abort code unknown to CiA 301", |(_, text)| text)
    }
}

/// The codes of CiA 301, table 22.
#[rustfmt::skip]
const TEXTS: [(u32, &str); 31] = [
    (0x0503_0000, "toggle bit not alternated"),
    (0x0504_0000, "SDO protocol timed out"),
    (0x0504_0001, "command specifier not valid or unknown"),
    (0x0504_0002, "invalid block size"),
    (0x0504_0003, "invalid sequence number"),
    (0x0504_0004, "CRC error"),
    (0x0504_0005, "out of memory"),
    (0x0601_0000, "unsupported access to an object"),
    (0x0601_0001, "attempt to read a write-only object"),
    (0x0601_0002, "attempt to write a read-only object"),
    (0x0602_0000, "object does not exist in the object dictionary"),
    (0x0604_0041, "object cannot be mapped to the PDO"),
    (0x0604_0042, "the mapped objects would exceed the length of the PDO"),
    (0x0604_0043, "general parameter incompatibility"),
    (0x0604_0047, "general internal incompatibility in the device"),
    (0x0606_0000, "access failed due to a hardware error"),
    (0x0607_0010, "data type does not match, length of service parameter does not match"),
    (0x0607_0012, "data type does not match, length of service parameter too high"),
    (0x0607_0013, "data type does not match, length of service parameter too low"),
    (0x0609_0011, "sub-index does not exist"),
    (0x0609_0030, "invalid value for parameter"),
    (0x0609_0031, "value of parameter written too high"),
    (0x0609_0032, "value of parameter written too low"),
    (0x0609_0036, "maximum value is less than minimum value"),
    (0x060A_0023, "resource not available: SDO connection"),
    (0x0800_0000, "general error"),
    (0x0800_0020, "data cannot be transferred or stored to the application"),
    (0x0800_0021, "data cannot be transferred or stored because of local control"),
    (0x0800_0022, "data cannot be transferred or stored because of the present device state"),
    (0x0800_0023, "no object dictionary is present, or its dynamic generation failed"),
    (0x0800_0024, "no data available"),
];

impl fmt::Display for AbortCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "0x{:08X} {}", self.0, self.text())
    }
}

impl fmt::Debug for AbortCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_of_the_31_codes_of_cia_301_has_its_own_text() {
        let known: Vec<u32> = [
            (0x0503_0000, 0..=0),
            (0x0504_0000, 0..=5),
            (0x0601_0000, 0..=2),
            (0x0602_0000, 0..=0),
            (0x0604_0000, 0x41..=0x43),
            (0x0604_0000, 0x47..=0x47),
            (0x0606_0000, 0..=0),
            (0x0607_0000, 0x10..=0x10),
            (0x0607_0000, 0x12..=0x13),
            (0x0609_0000, 0x11..=0x11),
            (0x0609_0000, 0x30..=0x32),
            (0x0609_0000, 0x36..=0x36),
            (0x060A_0000, 0x23..=0x23),
            (0x0800_0000, 0..=0),
            (0x0800_0000, 0x20..=0x24),
        ]
        .into_iter()
        .flat_map(|(base, range)| range.map(move |low| base + low))
        .collect();
        let texts: std::collections::HashSet<_> =
            known.iter().map(|code| AbortCode(*code).text()).collect();
        assert_eq!((known.len(), texts.len()), (31, 31));
        assert!(!texts.contains(AbortCode(1).text()));
        assert_eq!(
            AbortCode::NO_OBJECT.to_string(),
            "0x06020000 object does not exist in the object dictionary",
            "number and text"
        );
    }
}
