//! Network management (CiA 301, 7.2.8): the communication state of the nodes.
//!
//! ```text
//! 0x000   [command, node]     node 0: all
//!
//!   power on, reset -> initialising -- boot-up message --> pre-operational <-> operational
//!                                                                 ^               |
//!                                                                 +--> stopped <--+
//! ```
//!
//! SDO works in pre-operational and operational, PDO in operational only, the heartbeat in all of them.

use super::frame::{CanFrame, Id};

/// COB-ID of NMT commands.
pub const COB_ID: Id = Id::standard(0x000);

/// A command of the NMT master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Command {
    /// Enter operational: PDOs are exchanged.
    Start = 0x01,
    /// Enter stopped: only NMT and the heartbeat remain.
    Stop = 0x02,
    /// Enter pre-operational: SDO only.
    EnterPreOperational = 0x80,
    /// Restart the whole device.
    ResetNode = 0x81,
    /// Restart communication, with its objects as at power-on.
    ResetCommunication = 0x82,
}

impl Command {
    /// The frame with this command to `node`; 0 addresses all nodes.
    pub const fn frame(self, node: u8) -> CanFrame {
        CanFrame::new(COB_ID, [self as u8, node])
    }

    /// Decodes `[command, node]`; node 0 addresses all nodes.
    pub fn decode(data: &[u8]) -> Option<(Command, u8)> {
        let &[command, node] = data else { return None };
        let all = [
            Command::Start,
            Command::Stop,
            Command::EnterPreOperational,
            Command::ResetNode,
            Command::ResetCommunication,
        ];
        all.into_iter()
            .find(|known| *known as u8 == command)
            .map(|known| (known, node))
    }
}

/// The state of a node in its heartbeat.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum State {
    /// The boot-up message after a start.
    BootUp = 0x00,
    /// Only NMT and heartbeat work.
    Stopped = 0x04,
    /// Everything works.
    Operational = 0x05,
    /// Everything but PDO.
    PreOperational = 0x7F,
}

impl State {
    /// Decodes the byte of a heartbeat. Bit 7 toggles in the older node guarding and is not part of the state.
    pub const fn decode(byte: u8) -> Option<State> {
        match byte & 0x7F {
            0x00 => Some(State::BootUp),
            0x04 => Some(State::Stopped),
            0x05 => Some(State::Operational),
            0x7F => Some(State::PreOperational),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_have_the_bytes_of_the_standard() {
        let bytes: Vec<Vec<u8>> = [
            Command::Start,
            Command::Stop,
            Command::EnterPreOperational,
            Command::ResetNode,
            Command::ResetCommunication,
        ]
        .iter()
        .map(|command| command.frame(5).data().to_vec())
        .collect();
        assert_eq!(
            bytes,
            [[0x01, 5], [0x02, 5], [0x80, 5], [0x81, 5], [0x82, 5]]
        );
        assert_eq!(Command::decode(&[0x81, 0]), Some((Command::ResetNode, 0)));
        assert_eq!(Command::decode(&[0x03, 0]), None);
        assert_eq!(Command::decode(&[0x01]), None);
    }
}
