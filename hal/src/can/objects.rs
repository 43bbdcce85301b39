//! Objects of CiA 301 and CiA 402 that the driver and the emulated drive use.

use super::sdo::Address;

/// Device type: the profile in the lower half, 402 for a drive.
pub const DEVICE_TYPE: Address = Address::new(0x1000, 0);
/// Error register.
pub const ERROR_REGISTER: Address = Address::new(0x1001, 0);
/// Device name.
pub const DEVICE_NAME: Address = Address::new(0x1008, 0);
/// First entry of the heartbeat consumer: node and timeout.
pub const HEARTBEAT_CONSUMER: Address = Address::new(0x1016, 1);
/// Period of the heartbeat producer in milliseconds.
pub const HEARTBEAT_PRODUCER: Address = Address::new(0x1017, 0);
/// Reaction of the drive to the loss of the heartbeat.
pub const ABORT_CONNECTION: Address = Address::new(0x6007, 0);
/// Controlword.
pub const CONTROLWORD: Address = Address::new(0x6040, 0);
/// Statusword.
pub const STATUSWORD: Address = Address::new(0x6041, 0);
/// Requested mode of operation.
pub const MODE: Address = Address::new(0x6060, 0);
/// Active mode of operation.
pub const MODE_DISPLAY: Address = Address::new(0x6061, 0);
/// Target torque.
pub const TARGET: Address = Address::new(0x6071, 0);
/// Maximum torque in per mille of the rated torque.
pub const MAXIMUM: Address = Address::new(0x6072, 0);
/// Rated current in milliamperes.
pub const RATED_CURRENT: Address = Address::new(0x6075, 0);
/// Actual torque.
pub const ACTUAL: Address = Address::new(0x6077, 0);
/// Torque slope of profile torque.
pub const SLOPE: Address = Address::new(0x6087, 0);
/// Supported modes of operation; bit n - 1 is mode n.
pub const SUPPORTED_MODES: Address = Address::new(0x6502, 0);

/// Identity object: sub-index 1 vendor, 2 product, 3 revision, 4 serial number; 0 their count.
pub const fn identity(sub: u8) -> Address {
    Address::new(0x1018, sub)
}
