//! The object dictionary of the emulated drive, with the rules of CiA 301 for PDO parameters.

use std::collections::BTreeMap;

use super::super::objects as object;
use super::super::pdo::{Mapped, OFF, number_of};
use super::super::sdo::{AbortCode, Address, Dictionary};

/// Access to an object by SDO and PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Access {
    Read,
    Write,
    /// Read-only, and can be mapped to a PDO.
    MappedRead,
    /// Writable, and can be mapped to a PDO.
    MappedWrite,
}

#[derive(Clone, Debug)]
struct Object {
    value: Vec<u8>,
    access: Access,
    is_text: bool,
}

/// Objects by address, little endian.
#[derive(Clone, Debug, Default)]
pub struct ObjectDictionary {
    objects: BTreeMap<Address, Object>,
    written: Vec<Address>,
}

impl ObjectDictionary {
    /// Adds a number of `bytes` bytes.
    pub(super) fn add(&mut self, address: Address, bytes: usize, number: u32, access: Access) {
        let value = number.to_le_bytes()[..bytes].to_vec();
        self.objects.insert(
            address,
            Object {
                value,
                access,
                is_text: false,
            },
        );
    }

    /// Adds a text of variable length.
    pub(super) fn add_text(&mut self, address: Address, text: &str, access: Access) {
        self.objects.insert(
            address,
            Object {
                value: text.as_bytes().to_vec(),
                access,
                is_text: true,
            },
        );
    }

    /// Removes an object.
    pub(super) fn remove(&mut self, address: Address) {
        self.objects.remove(&address);
    }

    /// The unsigned number at `address`, 0 if it does not exist.
    pub fn number(&self, address: Address) -> u32 {
        let object = self.objects.get(&address);
        let value = object.map_or(&[][..], |object| &object.value);
        number_of(value.get(..4).unwrap_or(value))
    }

    /// Sets a number, without the checks of an SDO.
    pub(super) fn set(&mut self, address: Address, number: u32) {
        if let Some(object) = self.objects.get_mut(&address) {
            let bytes = object.value.len().min(4);
            object.value[..bytes].copy_from_slice(&number.to_le_bytes()[..bytes]);
        }
    }

    /// Size of the object in bits, 0 if it does not exist.
    fn bits(&self, address: Address) -> u32 {
        self.objects
            .get(&address)
            .map_or(0, |object| 8 * object.value.len() as u32)
    }

    /// Whether `address` was written since the last call.
    pub(super) fn take_written(&mut self, address: Address) -> bool {
        let was = self.written.contains(&address);
        self.written.retain(|other| *other != address);
        was
    }

    /// The active entries of the mapping at `index`.
    pub(super) fn mapping(&self, index: u16) -> Vec<Mapped> {
        let count = self.number(Address::new(index, 0)).min(8) as u8;
        (1..=count)
            .map(|sub| Mapped(self.number(Address::new(index, sub))))
            .collect()
    }

    fn check(&self, address: Address, number: u32) -> Result<(), AbortCode> {
        match (address.index, address.sub) {
            (0x1400..=0x1403 | 0x1800..=0x1803, 1) => self.check_cob_id(address, number),
            (0x1400..=0x1403 | 0x1800..=0x1803, 2) if (241..=253).contains(&number) => {
                Err(AbortCode::VALUE)
            }
            (0x1600..=0x1603 | 0x1A00..=0x1A03, 0) => self.check_count(address, number),
            (0x1600..=0x1603 | 0x1A00..=0x1A03, _) => self.check_entry(address, Mapped(number)),
            _ if address == object::MODE && number != 0 => self.check_mode(number as i8),
            _ => Ok(()),
        }
    }

    /// Bit n-1 of 0x6502 is mode n.
    fn check_mode(&self, mode: i8) -> Result<(), AbortCode> {
        let bit = mode.checked_sub(1).map(|bit| 1u32.checked_shl(bit as u32));
        let bit = bit.flatten().unwrap_or(0);
        match self.number(object::SUPPORTED_MODES) & bit {
            0 => Err(AbortCode::VALUE),
            _ => Ok(()),
        }
    }

    /// The identifier of a PDO cannot be changed while the PDO is on.
    fn check_cob_id(&self, address: Address, number: u32) -> Result<(), AbortCode> {
        let now = self.number(address);
        let both_on = now & OFF == 0 && number & OFF == 0;
        if both_on && now != number {
            Err(AbortCode::VALUE)
        } else {
            Ok(())
        }
    }

    /// Whether the PDO whose mapping is at `index` is on.
    fn is_on(&self, index: u16) -> bool {
        self.number(Address::new(index - 0x200, 1)) & OFF == 0
    }

    fn check_count(&self, address: Address, count: u32) -> Result<(), AbortCode> {
        if self.is_on(address.index) {
            return Err(AbortCode::STATE);
        }
        let words = (1..=count.min(9))
            .map(|sub| Mapped(self.number(Address::new(address.index, sub as u8))));
        let bits: u32 = words.map(|word| u32::from(word.bits())).sum();
        if count > 8 || bits > 64 {
            Err(AbortCode::PDO_LENGTH)
        } else {
            Ok(())
        }
    }

    fn check_entry(&self, address: Address, word: Mapped) -> Result<(), AbortCode> {
        if self.is_on(address.index) || self.number(Address::new(address.index, 0)) != 0 {
            return Err(AbortCode::ACCESS);
        }
        let Some(object) = self.objects.get(&word.address()) else {
            return Err(AbortCode::NO_OBJECT);
        };
        let fits = matches!(object.access, Access::MappedRead | Access::MappedWrite)
            && self.bits(word.address()) == u32::from(word.bits());
        if fits {
            Ok(())
        } else {
            Err(AbortCode::NOT_MAPPABLE)
        }
    }
}

impl Dictionary for ObjectDictionary {
    fn read(&self, address: Address) -> Result<Vec<u8>, AbortCode> {
        let known = self
            .objects
            .range(Address::new(address.index, 0)..=Address::new(address.index, 255))
            .next();
        let missing = if known.is_some() {
            AbortCode::NO_SUB_INDEX
        } else {
            AbortCode::NO_OBJECT
        };
        self.objects
            .get(&address)
            .map(|object| object.value.clone())
            .ok_or(missing)
    }

    fn write(&mut self, address: Address, value: &[u8]) -> Result<(), AbortCode> {
        let before = self.read(address)?;
        let Some(object) = self.objects.get(&address) else {
            return Err(AbortCode::NO_OBJECT);
        };
        if matches!(object.access, Access::Read | Access::MappedRead) {
            return Err(AbortCode::READ_ONLY);
        }
        if !object.is_text {
            if before.len() != value.len() {
                return Err(AbortCode::LENGTH);
            }
            self.check(address, number_of(value))?;
        }
        if let Some(object) = self.objects.get_mut(&address) {
            object.value = value.to_vec();
        }
        if !self.written.contains(&address) {
            self.written.push(address);
        }
        Ok(())
    }
}
