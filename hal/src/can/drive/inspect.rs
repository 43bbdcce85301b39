//! Reads the properties of a drive without changing anything.

use std::time::Duration;

use super::super::bus::Host;
use super::super::cia402::State;
pub use super::super::objects::ABORT_CONNECTION;
use super::super::objects::{
    DEVICE_NAME, DEVICE_TYPE, ERROR_REGISTER, HEARTBEAT_CONSUMER, HEARTBEAT_PRODUCER, MAXIMUM,
    RATED_CURRENT, STATUSWORD, SUPPORTED_MODES, identity,
};
use super::super::sdo::{Address, Channel, SdoError, answer_id};

/// Properties of a drive. `None`: the drive does not have the object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inspection {
    /// Device type, 0x1000: the profile in the lower half (402 for a drive).
    pub device_type: Option<u32>,
    /// Device name, 0x1008.
    pub name: Option<String>,
    /// Vendor, product, revision and serial number of 0x1018.
    pub identity: [Option<u32>; 4],
    /// Error register, 0x1001; see [`register_names`](crate::can::emcy::register_names).
    pub error_register: Option<u8>,
    /// Statusword, 0x6041.
    pub statusword: Option<u16>,
    /// Supported modes, 0x6502.
    pub modes: Option<u32>,
    /// Rated current, 0x6075, in amperes.
    pub rated_current_a: Option<f64>,
    /// Maximum current, 0x6072, as a ratio of the rated current.
    pub maximum_current_ratio: Option<f64>,
    /// Codes of past errors, 0x1003, the latest first; see [`text`](crate::can::emcy::text).
    pub past_errors: Vec<u16>,
    /// Those of [`REQUIRED_OBJECTS`] that the drive does not have.
    pub missing_objects: Vec<Address>,
}

/// Objects without which driver and drive cannot monitor each other: heartbeat consumer and producer, and the reaction to a
/// lost heartbeat. The last one is not required if the drive's own reaction has been verified.
pub const REQUIRED_OBJECTS: [Address; 3] =
    [HEARTBEAT_CONSUMER, HEARTBEAT_PRODUCER, ABORT_CONNECTION];
/// Largest number of past errors that are read.
const PAST_ERRORS_MAX: u8 = 4;

impl Inspection {
    /// The state in the statusword.
    pub fn state(&self) -> Option<State> {
        self.statusword.and_then(State::decode)
    }
}

/// Reads the properties of a drive. Nothing is written and nothing moves. No driver may have the node open, because two
/// readers would receive each other's answers.
pub fn inspect(host: &dyn Host, node: u8, timeout: Duration) -> Result<Inspection, SdoError> {
    let mut bus = host.endpoint(&[answer_id(node)])?;
    let channel = &mut Channel {
        bus: bus.as_mut(),
        host,
        node,
        timeout,
    };
    let device_type = if_present(channel.read_u32(DEVICE_TYPE))?;
    let identity = read_identity(channel)?;
    let name = if_present(channel.read(DEVICE_NAME))?;
    let error_register = if_present(channel.read_u8(ERROR_REGISTER))?;
    let statusword = if_present(channel.read_u16(STATUSWORD))?;
    let modes = if_present(channel.read_u32(SUPPORTED_MODES))?;
    let rated_ma = if_present(channel.read_u32(RATED_CURRENT))?;
    let maximum_per_mille = if_present(channel.read_u16(MAXIMUM))?;
    Ok(Inspection {
        device_type,
        identity,
        name: name.map(text),
        error_register,
        statusword,
        modes,
        rated_current_a: rated_ma.map(|rated_ma| f64::from(rated_ma) * 1e-3),
        maximum_current_ratio: maximum_per_mille.map(|ratio| f64::from(ratio) * 1e-3),
        past_errors: read_past_errors(channel)?,
        missing_objects: find_missing_objects(channel)?,
    })
}

fn read_identity(channel: &mut Channel<'_>) -> Result<[Option<u32>; 4], SdoError> {
    let mut fields = [None; 4];
    for (sub, field) in (1..).zip(&mut fields) {
        *field = if_present(channel.read_u32(identity(sub)))?;
    }
    Ok(fields)
}

fn text(bytes: Vec<u8>) -> String {
    let text = String::from_utf8_lossy(&bytes);
    text.trim_end_matches('\0').to_owned()
}

/// Sub-index 0 is the number of errors, 1 the latest.
fn read_past_errors(channel: &mut Channel<'_>) -> Result<Vec<u16>, SdoError> {
    let count = if_present(channel.read_u8(Address::new(0x1003, 0)))?.unwrap_or(0);
    let mut codes = Vec::new();
    for sub in 1..=count.min(PAST_ERRORS_MAX) {
        let entry = if_present(channel.read_u32(Address::new(0x1003, sub)))?;
        codes.extend(entry.map(|entry| entry as u16));
    }
    Ok(codes)
}

fn find_missing_objects(channel: &mut Channel<'_>) -> Result<Vec<Address>, SdoError> {
    let mut missing = Vec::new();
    for address in REQUIRED_OBJECTS {
        if if_present(channel.read(address))?.is_none() {
            missing.push(address);
        }
    }
    Ok(missing)
}

/// `None` if the object does not exist.
fn if_present<T>(read: Result<T, SdoError>) -> Result<Option<T>, SdoError> {
    match read {
        Ok(value) => Ok(Some(value)),
        Err(error) if error.means_absent() => Ok(None),
        Err(error) => Err(error),
    }
}
