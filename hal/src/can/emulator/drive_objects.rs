//! Settings and objects of the emulated drive.

use super::super::cia402::{CYCLIC_TORQUE, PROFILE_TORQUE};
use super::super::objects::*;
use super::super::pdo::{Direction, OFF, cob_id, parameters};
use super::super::scale::Reference;
use super::super::sdo::Address;
use super::dictionary::{Access, ObjectDictionary};

/// Settings of an emulated drive.
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
    /// The current that 1000 counts of the target represent.
    pub reference: Reference,
    /// Supported modes of operation, 0x6502: mode 4 is bit 3, mode 10 is bit 9.
    pub modes: u32,
    /// Objects that this drive does not have.
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

/// The object dictionary after power-on.
pub(super) fn dictionary(settings: &EmulatedDriveSettings) -> ObjectDictionary {
    let mut objects = ObjectDictionary::default();
    communication(&mut objects, settings);
    for number in 1..=4 {
        pdo(&mut objects, Direction::Receive, number, settings.node);
        pdo(&mut objects, Direction::Transmit, number, settings.node);
    }
    drive(&mut objects, settings);
    for address in &settings.missing_objects {
        objects.remove(*address);
    }
    objects
}

fn communication(objects: &mut ObjectDictionary, settings: &EmulatedDriveSettings) {
    objects.add(DEVICE_TYPE, 4, 0x0002_0192, Access::Read); // servo drive, profile 402
    objects.add(ERROR_REGISTER, 1, 0, Access::Read);
    objects.add_text(DEVICE_NAME, &settings.name, Access::Read);
    objects.add(Address::new(0x1016, 0), 1, 1, Access::Read);
    objects.add(HEARTBEAT_CONSUMER, 4, 0, Access::Write);
    objects.add(HEARTBEAT_PRODUCER, 2, 0, Access::Write);
    objects.add(identity(0), 1, 4, Access::Read);
    for (sub, number) in (1..).zip(settings.identity) {
        objects.add(identity(sub), 4, number, Access::Read);
    }
    objects.add_text(Address::new(0x2000, 0), "", Access::Write); // a text of the user, of any length
}

/// PDO 1 is on after power-on, the others are off.
fn pdo(objects: &mut ObjectDictionary, direction: Direction, number: u8, node: u8) {
    let index = parameters(direction, number);
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
    objects.add(CONTROLWORD, 2, 0, Access::MappedWrite);
    objects.add(STATUSWORD, 2, 0x40, Access::MappedRead);
    objects.add(MODE, 1, 0, Access::MappedWrite);
    objects.add(MODE_DISPLAY, 1, 0, Access::MappedRead);
    objects.add(TARGET, 2, 0, Access::MappedWrite);
    objects.add(
        MAXIMUM,
        2,
        u32::from(settings.maximum_per_mille),
        Access::Write,
    );
    objects.add(RATED_CURRENT, 4, settings.rated_current_ma, Access::Read);
    objects.add(ACTUAL, 2, 0, Access::MappedRead);
    objects.add(SLOPE, 4, 1000, Access::Write);
    objects.add(SUPPORTED_MODES, 4, settings.modes, Access::Read);
}
