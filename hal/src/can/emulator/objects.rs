//! What the simulated drive is, and the objects it has.

use super::super::cia402::{CYCLIC_TORQUE, PROFILE_TORQUE};
use super::super::pdo::{Direction, OFF, cob_id};
use super::super::scale::Reference;
use super::super::sdo::Address;
use super::dictionary::{Access, ObjectDictionary};

pub(super) const HEARTBEAT_CONSUMER: Address = Address::new(0x1016, 1);
pub(super) const HEARTBEAT_PRODUCER: Address = Address::new(0x1017, 0);
pub(super) const ABORT_CONNECTION: Address = Address::new(0x6007, 0);
pub(super) const CONTROLWORD: Address = Address::new(0x6040, 0);
pub(super) const STATUSWORD: Address = Address::new(0x6041, 0);
pub(super) const MODE: Address = Address::new(0x6060, 0);
pub(super) const MODE_DISPLAY: Address = Address::new(0x6061, 0);
pub(super) const TARGET: Address = Address::new(0x6071, 0);
pub(super) const ACTUAL: Address = Address::new(0x6077, 0);
pub(super) const SUPPORTED_MODES: Address = Address::new(0x6502, 0);
/// Objects that a PDO may carry but nobody may write.
pub(super) const SHOWN: [Address; 3] = [STATUSWORD, MODE_DISPLAY, ACTUAL];

/// What a simulated drive is.
#[derive(Clone, Debug, PartialEq)]
pub struct EmulatedDriveSettings {
    /// Node number, 1 to 127.
    pub node: u8,
    /// Vendor, product, revision and serial number of 0x1018.
    pub identity: [u32; 4],
    /// Name in 0x1008.
    pub name: String,
    /// Rated current, in milliamperes.
    pub rated_current_ma: u32,
    /// Maximum torque 0x6072, per mille of rated.
    pub maximum_per_mille: u16,
    /// What 1000 counts of the target are.
    pub reference: Reference,
    /// Modes of operation it has; bits of 0x6502: mode 4 is bit 3, mode 10 bit 9.
    pub modes: u32,
    /// Objects it lacks, of those it could have.
    pub missing_objects: Vec<Address>,
}

impl Default for EmulatedDriveSettings {
    fn default() -> Self {
        EmulatedDriveSettings {
            node: 5,
            identity: [0x0000_0402, 0x0000_0001, 0x0001_0000, 1],
            name: "simulated CANopen drive".to_owned(),
            rated_current_ma: 4000,
            maximum_per_mille: 1500,
            reference: Reference::Rated,
            modes: 1 << (CYCLIC_TORQUE - 1) | 1 << (PROFILE_TORQUE - 1),
            missing_objects: Vec::new(),
        }
    }
}

impl EmulatedDriveSettings {
    /// The current of 1000 counts, in amperes.
    pub(super) fn reference_a(&self) -> f64 {
        let rated_a = f64::from(self.rated_current_ma.max(1)) * 1e-3;
        match self.reference {
            Reference::Rated => rated_a,
            Reference::Maximum => rated_a * f64::from(self.maximum_per_mille.max(1)) * 1e-3,
        }
    }
}

/// The objects as after power-on.
pub(super) fn dictionary(settings: &EmulatedDriveSettings) -> ObjectDictionary {
    let mut objects = ObjectDictionary::default();
    communication(&mut objects, settings);
    for number in 1..=4 {
        pdo(&mut objects, Direction::Receive, number, settings.node);
        pdo(&mut objects, Direction::Transmit, number, settings.node);
    }
    drive(&mut objects, settings);
    settings
        .missing_objects
        .iter()
        .for_each(|address| objects.remove(*address));
    objects
}

fn communication(objects: &mut ObjectDictionary, settings: &EmulatedDriveSettings) {
    objects.add(Address::new(0x1000, 0), 4, 0x0002_0192, Access::Read); // servo drive, profile 402
    objects.add(Address::new(0x1001, 0), 1, 0, Access::Read);
    objects.add_text(Address::new(0x1008, 0), &settings.name, Access::Read);
    objects.add(Address::new(0x1016, 0), 1, 1, Access::Read);
    objects.add(HEARTBEAT_CONSUMER, 4, 0, Access::Write);
    objects.add(HEARTBEAT_PRODUCER, 2, 0, Access::Write);
    objects.add(Address::new(0x1018, 0), 1, 4, Access::Read);
    for (sub, number) in (1..).zip(settings.identity) {
        objects.add(Address::new(0x1018, sub), 4, number, Access::Read);
    }
    objects.add_text(Address::new(0x2000, 0), "", Access::Write); // a note of the owner, any length
}

/// PDO 1 is on from the start, as is usual; the others are off.
fn pdo(objects: &mut ObjectDictionary, direction: Direction, number: u8, node: u8) {
    let index = super::super::pdo::parameters(direction, number);
    let off = if number == 1 { 0 } else { OFF };
    objects.add(Address::new(index, 0), 1, 5, Access::Read);
    objects.add(
        Address::new(index, 1),
        4,
        cob_id(direction, number, node).raw() | off,
        Access::Write,
    );
    objects.add(Address::new(index, 2), 1, 255, Access::Write);
    objects.add(Address::new(index, 3), 2, 0, Access::Write);
    objects.add(Address::new(index, 5), 2, 0, Access::Write);
    objects.add(Address::new(index + 0x200, 0), 1, 0, Access::Write);
    for sub in 1..=8 {
        objects.add(Address::new(index + 0x200, sub), 4, 0, Access::Write);
    }
}

fn drive(objects: &mut ObjectDictionary, settings: &EmulatedDriveSettings) {
    objects.add(ABORT_CONNECTION, 2, 0, Access::Write);
    objects.add(CONTROLWORD, 2, 0, Access::Mapped);
    objects.add(STATUSWORD, 2, 0x40, Access::Mapped);
    objects.add(MODE, 1, 0, Access::Mapped);
    objects.add(MODE_DISPLAY, 1, 0, Access::Mapped);
    objects.add(TARGET, 2, 0, Access::Mapped);
    objects.add(
        Address::new(0x6072, 0),
        2,
        u32::from(settings.maximum_per_mille),
        Access::Write,
    );
    objects.add(
        Address::new(0x6075, 0),
        4,
        settings.rated_current_ma,
        Access::Read,
    );
    objects.add(ACTUAL, 2, 0, Access::Mapped);
    objects.add(Address::new(0x6087, 0), 4, 1000, Access::Write);
    objects.add(SUPPORTED_MODES, 4, settings.modes, Access::Read);
}
