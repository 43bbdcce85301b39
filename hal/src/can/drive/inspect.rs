//! Looks at a drive without changing anything.

use std::time::Duration;

use super::super::bus::Host;
use super::super::cia402::State;
use super::super::sdo::{Address, Channel, SdoError, answer_id};

/// What a drive says of itself. `None`: it does not have the object.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Inspection {
    /// Device name, 0x1008.
    pub name: Option<String>,
    /// Vendor, product, revision and serial number of 0x1018.
    pub identity: [Option<u32>; 4],
    /// Error register, 0x1001; [`super::super::emcy::register_words`] puts it into words.
    pub error_register: Option<u8>,
    /// Statusword, 0x6041.
    pub statusword: Option<u16>,
    /// Supported modes, 0x6502.
    pub modes: Option<u32>,
    /// Rated current, 0x6075, in amperes.
    pub rated_current_a: Option<f64>,
}

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
    let mut channel = Channel { bus: bus.as_mut(), host, node, timeout };
    let mut identity = [None; 4];
    for (sub, field) in (1..).zip(&mut identity) {
        *field = present(channel.read_u32(Address::new(0x1018, sub)))?;
    }
    let name = present(channel.read(Address::new(0x1008, 0)))?;
    Ok(Inspection {
        name: name.map(|name| String::from_utf8_lossy(&name).trim_end_matches('\0').to_owned()),
        identity,
        error_register: present(channel.read_u8(Address::new(0x1001, 0)))?,
        statusword: present(channel.read_u16(Address::new(0x6041, 0)))?,
        modes: present(channel.read_u32(Address::new(0x6502, 0)))?,
        rated_current_a: present(channel.read_u32(Address::new(0x6075, 0)))?.map(|milli| f64::from(milli) * 1e-3),
    })
}

/// An object that is not there is no error.
fn present<T>(read: Result<T, SdoError>) -> Result<Option<T>, SdoError> {
    match read {
        Ok(value) => Ok(Some(value)),
        Err(error) if error.means_absent() => Ok(None),
        Err(error) => Err(error),
    }
}
