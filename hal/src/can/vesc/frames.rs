//! The frames of a VESC.

use super::super::frame::{CanFrame, Id};

/// SET_CURRENT to `node`, in milliamperes.
pub const fn set_current(node: u8, current_ma: i32) -> CanFrame {
    CanFrame::new(Id::extended(1 << 8 | node as u32), current_ma.to_be_bytes())
}

/// Identifier of STATUS from `node`.
pub const fn status_id(node: u8) -> Id {
    Id::extended(9 << 8 | node as u32)
}

/// The motor current of a STATUS frame, in units of 0.1 A.
pub fn status_current(data: &[u8]) -> Option<i16> {
    let &[_, _, _, _, high, low, _, _] = data else {
        return None;
    };
    Some(i16::from_be_bytes([high, low]))
}
