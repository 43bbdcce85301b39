//! Looks at a drive without changing anything.

use std::time::Duration;

use super::super::bus::Host;
use super::super::cia402::State;
use super::super::sdo::{Address, Channel, SdoError, answer_id};

/// What a drive says of itself. `None`: it does not have the object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inspection {
    /// Device type, 0x1000: the profile in the lower half (402 for a drive).
    pub device_type: Option<u32>,
    /// Device name, 0x1008.
    pub name: Option<String>,
    /// Vendor, product, revision and serial number of 0x1018.
    pub identity: [Option<u32>; 4],
    /// Error register, 0x1001; [`super::super::emcy::register_names`] puts it into words.
    pub error_register: Option<u8>,
    /// Statusword, 0x6041.
    pub statusword: Option<u16>,
    /// Supported modes, 0x6502.
    pub modes: Option<u32>,
    /// Rated current, 0x6075, in amperes.
    pub rated_current_a: Option<f64>,
    /// The largest current, 0x6072, as a ratio of the rated one.
    pub maximum_current_ratio: Option<f64>,
    /// Past errors, 0x1003, the latest first: codes for [`super::super::emcy::text`].
    pub past_errors: Vec<u16>,
    /// Objects it lacks of those without which it cannot be watched: see [`REQUIRED_OBJECTS`].
    pub missing_objects: Vec<Address>,
}

/// Heartbeat consumer and producer, and what the drive does when it hears nobody (0x6007).
pub const REQUIRED_OBJECTS: [Address; 3] = [
    Address::new(0x1016, 1),
    Address::new(0x1017, 0),
    ABORT_CONNECTION,
];
/// What a drive does when it hears nobody; not needed where its own reaction is trusted.
pub const ABORT_CONNECTION: Address = Address::new(0x6007, 0);
/// Past errors that are read, at most.
const PAST_ERRORS: u8 = 4;

impl Inspection {
    /// The state that the statusword tells.
    pub fn state(&self) -> Option<State> {
        self.statusword.and_then(State::decode)
    }
}

/// Reads what a drive says of itself; nothing is written, nothing moves. Only while no driver has the node open: two
/// readers would take each other's answers.
pub fn inspect(host: &dyn Host, node: u8, timeout: Duration) -> Result<Inspection, SdoError> {
    let mut bus = host.endpoint(&[answer_id(node)])?;
    let mut channel = Channel {
        bus: bus.as_mut(),
        host,
        node,
        timeout,
    };
    let device_type = present(channel.read_u32(Address::new(0x1000, 0)))?;
    let mut identity = [None; 4];
    for (sub, field) in (1..).zip(&mut identity) {
        *field = present(channel.read_u32(Address::new(0x1018, sub)))?;
    }
    let name = present(channel.read(Address::new(0x1008, 0)))?;
    Ok(Inspection {
        device_type,
        name: name.map(|name| {
            String::from_utf8_lossy(&name)
                .trim_end_matches('\0')
                .to_owned()
        }),
        identity,
        error_register: present(channel.read_u8(Address::new(0x1001, 0)))?,
        statusword: present(channel.read_u16(Address::new(0x6041, 0)))?,
        modes: present(channel.read_u32(Address::new(0x6502, 0)))?,
        rated_current_a: present(channel.read_u32(Address::new(0x6075, 0)))?
            .map(|milli| f64::from(milli) * 1e-3),
        maximum_current_ratio: present(channel.read_u16(Address::new(0x6072, 0)))?
            .map(|mille| f64::from(mille) * 1e-3),
        past_errors: past_errors(&mut channel)?,
        missing_objects: missing_objects(&mut channel)?,
    })
}

/// Sub-index 0 counts them, 1 is the latest.
fn past_errors(channel: &mut Channel<'_>) -> Result<Vec<u16>, SdoError> {
    let count = present(channel.read_u8(Address::new(0x1003, 0)))?
        .unwrap_or(0)
        .min(PAST_ERRORS);
    let entries = (1..=count).map(|sub| present(channel.read_u32(Address::new(0x1003, sub))));
    Ok(entries
        .collect::<Result<Vec<_>, _>>()?
        .into_iter()
        .flatten()
        .map(|entry| entry as u16)
        .collect())
}

fn missing_objects(channel: &mut Channel<'_>) -> Result<Vec<Address>, SdoError> {
    let mut missing_objects = Vec::new();
    for address in REQUIRED_OBJECTS {
        if present(channel.read(address))?.is_none() {
            missing_objects.push(address);
        }
    }
    Ok(missing_objects)
}

/// An object that is not there is no error.
fn present<T>(read: Result<T, SdoError>) -> Result<Option<T>, SdoError> {
    match read {
        Ok(value) => Ok(Some(value)),
        Err(error) if error.means_absent() => Ok(None),
        Err(error) => Err(error),
    }
}
