//! Heartbeat (CiA 301, 7.2.8.2.2): a node sends its state periodically, and others detect its loss.
//!
//! ```text
//! 0x700 + node   [state]      0 boot-up, 4 stopped, 5 operational, 0x7F pre-operational
//! 0x1017         u16, ms      heartbeat period of a node, 0 = none
//! 0x1016 sub n   u32          consumer entry: node << 16 | time in ms; monitoring begins with the first heartbeat received
//! ```

use super::frame::{CanFrame, Id};
use super::nmt::State;

/// Identifier of the heartbeat of `node` (1 to 127).
pub const fn cob_id(node: u8) -> Id {
    Id::standard(0x700 + (node & 0x7F) as u16)
}

/// The heartbeat of `node` in `state`.
pub const fn frame(node: u8, state: State) -> CanFrame {
    CanFrame::new(cob_id(node), [state as u8])
}

/// Decodes a heartbeat: one byte with a known state.
pub fn decode(data: &[u8]) -> Option<State> {
    match data {
        &[state] => State::decode(state),
        _ => None,
    }
}

/// The entry of 0x1016 that monitors `node`: `node << 16 | milliseconds`.
pub const fn consumer_entry(node: u8, timeout_ms: u16) -> u32 {
    (node as u32) << 16 | timeout_ms as u32
}

/// The monitored node and its time limit in milliseconds; `None` for an unused entry.
pub fn monitored(entry: u32) -> Option<(u8, u16)> {
    let (node, timeout_ms) = ((entry >> 16) as u8, entry as u16);
    ((1..=127).contains(&node) && timeout_ms > 0).then_some((node, timeout_ms))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_heartbeat_is_one_byte_at_0x700_plus_node() {
        let frame = frame(5, State::Operational);
        assert_eq!((frame.id(), frame.data()), (Id::standard(0x705), &[5][..]));
        assert_eq!(decode(&[0]), Some(State::BootUp));
        assert_eq!(decode(&[0x7F]), Some(State::PreOperational));
        assert_eq!(
            decode(&[0x85]),
            Some(State::Operational),
            "bit 7 toggles in node guarding"
        );
        assert_eq!(decode(&[1]), None);
        assert_eq!(decode(&[]), None);
    }

    #[test]
    fn consumer_entries_contain_node_and_time() {
        assert_eq!(consumer_entry(0x7F, 100), 0x007F_0064);
        assert_eq!(monitored(0x007F_0064), Some((0x7F, 100)));
        assert_eq!(monitored(0), None);
        assert_eq!(monitored(0x0080_0064), None, "node numbers end at 127");
    }
}
