//! Process data objects (CiA 301, 7.2.2 and 7.5.2.35 ff.): the cyclic frames and their layout.
//!
//! ```text
//! RPDO n (to the node)     0x100 + 0x100 n + node    parameters 0x1400 + n-1    mapping 0x1600 + n-1
//! TPDO n (from the node)   0x080 + 0x100 n + node    parameters 0x1800 + n-1    mapping 0x1A00 + n-1
//!
//! parameters   sub 1  COB-ID u32, bit 31: off, bit 30: no remote frames, bits 10..0: identifier
//!              sub 2  transmission type u8: 0 to 240 with SYNC (n: every n-th), 254 and 255 asynchronous
//!              sub 3  inhibit time u16, in 100 us: shortest time between two frames
//!              sub 5  event timer u16, in ms: longest time between two frames
//! mapping      sub 0  count u8; sub 1 .. 8  index << 16 | sub << 8 | bits
//! ```
//!
//! A mapping is changed only while the PDO is off and its count is 0, in this order: off, count 0, entries, count,
//! transmission type and times, on.

use super::frame::Id;
use super::sdo::Address;

/// Bit 31 of the COB-ID: the PDO is off.
pub const OFF: u32 = 1 << 31;
/// Bit 30 of the COB-ID: no remote frames. The setting of the node is preserved.
pub const NO_REMOTE: u32 = 1 << 30;
/// Transmission type: asynchronous, according to the profile of the device.
pub const ASYNCHRONOUS: u8 = 255;

/// One entry of a mapping: `index << 16 | sub << 8 | bits`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mapped(pub u32);

impl Mapped {
    /// The object at `address`, of `bits` bits.
    pub const fn new(address: Address, bits: u8) -> Mapped {
        Mapped((address.index as u32) << 16 | (address.sub as u32) << 8 | bits as u32)
    }

    /// The address of the object.
    pub const fn address(self) -> Address {
        Address::new((self.0 >> 16) as u16, (self.0 >> 8) as u8)
    }

    /// The number of bits.
    pub const fn bits(self) -> u8 {
        self.0 as u8
    }
}

/// The direction as seen from the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// The node receives: set-points.
    Receive,
    /// The node transmits: actual values.
    Transmit,
}

/// Identifier of a PDO by the predefined connection set; `number` from 1 to 4, `node` from 1 to 127.
pub const fn cob_id(direction: Direction, number: u8, node: u8) -> Id {
    let base = match direction {
        Direction::Receive => 0x100,
        Direction::Transmit => 0x080,
    };
    Id::standard(base + 0x100 * (number & 0x7) as u16 + (node & 0x7F) as u16)
}

/// Communication parameters of PDO `number`, from 1.
pub const fn parameters(direction: Direction, number: u8) -> u16 {
    let base = match direction {
        Direction::Receive => 0x1400,
        Direction::Transmit => 0x1800,
    };
    base + number as u16 - 1
}

/// The configuration of a PDO.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Pdo {
    /// To or from the node.
    pub direction: Direction,
    /// From 1 to 4.
    pub number: u8,
    /// The node, from 1 to 127.
    pub node: u8,
    /// The mapped objects, in order.
    pub entries: Vec<Mapped>,
    /// Transmission type: when it is sent or takes effect.
    pub transmission: u8,
    /// Inhibit time in 100 us; `None` leaves that of the node.
    pub inhibit_100us: Option<u16>,
    /// Event timer in ms; `None` leaves that of the node.
    pub event_timer_ms: Option<u16>,
}

/// The value of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Value {
    /// The object.
    pub address: Address,
    /// The value as an unsigned number.
    pub number: u32,
    /// Its length: one, two or four.
    pub bytes: usize,
}

impl Value {
    const fn new(index: u16, sub: u8, number: u32, bytes: usize) -> Value {
        Value {
            address: Address::new(index, sub),
            number,
            bytes,
        }
    }
}

/// The unsigned number with these bytes, little endian.
pub(super) fn number_of(bytes: &[u8]) -> u32 {
    bytes
        .iter()
        .rev()
        .fold(0, |number, byte| number << 8 | u32::from(*byte))
}

impl Pdo {
    fn parameter_index(&self) -> u16 {
        parameters(self.direction, self.number)
    }

    /// The address of the COB-ID.
    pub fn cob_id_address(&self) -> Address {
        Address::new(self.parameter_index(), 1)
    }

    /// The values to write, in order. `cob_id_now` is the present value of [`Pdo::cob_id_address`].
    pub fn sequence(&self, cob_id_now: u32) -> Vec<Value> {
        let on = cob_id(self.direction, self.number, self.node).raw() | cob_id_now & NO_REMOTE;
        let off = Value::new(self.parameter_index(), 1, on | OFF, 4);
        let clear = Value::new(self.parameter_index() + 0x200, 0, 0, 1);
        [off, clear]
            .into_iter()
            .chain(self.layout())
            .chain([Value::new(self.parameter_index(), 1, on, 4)])
            .collect()
    }

    /// Entries, count, transmission type and times: the values that are read back for verification.
    pub fn layout(&self) -> Vec<Value> {
        let (parameters, mapping) = (self.parameter_index(), self.parameter_index() + 0x200);
        let entries = (1..)
            .zip(&self.entries)
            .map(|(sub, entry)| Value::new(mapping, sub, entry.0, 4));
        let count = Value::new(mapping, 0, self.entries.len() as u32, 1);
        let transmission = Value::new(parameters, 2, u32::from(self.transmission), 1);
        let times = [(3, self.inhibit_100us), (5, self.event_timer_ms)];
        let times = times
            .into_iter()
            .filter_map(|(sub, time)| Some(Value::new(parameters, sub, u32::from(time?), 2)));
        entries.chain([count, transmission]).chain(times).collect()
    }
}

/// Four bytes of a u16 and an i16, little endian: controlword and target, or statusword and actual value.
pub const fn pack(word: u16, value: i16) -> [u8; 4] {
    let ([a, b], [c, d]) = (word.to_le_bytes(), value.to_le_bytes());
    [a, b, c, d]
}

/// The inverse of [`pack`]; `None` unless there are exactly four bytes.
pub fn unpack(data: &[u8]) -> Option<(u16, i16)> {
    let &[a, b, c, d] = data else { return None };
    Some((u16::from_le_bytes([a, b]), i16::from_le_bytes([c, d])))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mapping_word_is_index_sub_index_and_bits() {
        let word = Mapped::new(Address::new(0x6041, 0), 16);
        assert_eq!(word, Mapped(0x6041_0010));
        assert_eq!((word.address(), word.bits()), (Address::new(0x6041, 0), 16));
    }

    #[test]
    fn identifiers_are_those_of_the_predefined_connection_set() {
        let ids = [1, 2, 3, 4].map(|number| cob_id(Direction::Receive, number, 5).raw());
        assert_eq!(ids, [0x205, 0x305, 0x405, 0x505]);
        let ids = [1, 2, 3, 4].map(|number| cob_id(Direction::Transmit, number, 5).raw());
        assert_eq!(ids, [0x185, 0x285, 0x385, 0x485]);
        assert_eq!(
            (
                parameters(Direction::Receive, 1),
                parameters(Direction::Transmit, 4)
            ),
            (0x1400, 0x1803)
        );
    }

    #[test]
    fn a_mapping_is_changed_while_the_pdo_is_off_and_empty() {
        let target = Mapped::new(Address::new(0x6071, 0), 16);
        let pdo = Pdo {
            direction: Direction::Receive,
            number: 1,
            node: 5,
            entries: vec![Mapped::new(Address::new(0x6040, 0), 16), target],
            transmission: 1,
            inhibit_100us: None,
            event_timer_ms: None,
        };
        let written: Vec<_> = pdo
            .sequence(NO_REMOTE | 0x123)
            .iter()
            .map(|value| {
                (
                    value.address.index,
                    value.address.sub,
                    value.number,
                    value.bytes,
                )
            })
            .collect();
        assert_eq!(
            written,
            [
                (0x1400, 1, 0xC000_0205, 4), // off, with the node's own bit 30
                (0x1600, 0, 0, 1),           // empty
                (0x1600, 1, 0x6040_0010, 4),
                (0x1600, 2, 0x6071_0010, 4),
                (0x1600, 0, 2, 1),
                (0x1400, 2, 1, 1),
                (0x1400, 1, 0x4000_0205, 4), // on
            ]
        );
    }

    #[test]
    fn words_are_little_endian() {
        assert_eq!(pack(0x000F, -2), [0x0F, 0, 0xFE, 0xFF]);
        assert_eq!(unpack(&[0x37, 0x12, 0x18, 0xFC]), Some((0x1237, -1000)));
        assert_eq!(unpack(&[0; 3]), None);
        assert_eq!(unpack(&[0; 5]), None);
    }
}
