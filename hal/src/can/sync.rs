//! SYNC (CiA 301, 7.2.5): all nodes apply their synchronous set-points and sample their values at the same time.
//!
//! `0x080` without data; the counter of 0x1019 is not used.

use super::frame::{CanFrame, Id};

/// COB-ID of SYNC.
pub const COB_ID: Id = Id::standard(0x080);

/// The SYNC frame.
pub const FRAME: CanFrame = CanFrame::new(COB_ID, []);
