//! SYNC (CiA 301, 7.2.5): all nodes take their synchronous set-points and sample at one moment.
//!
//! `0x080`, without data (the counter of 0x1019 is not used).

use super::frame::{CanFrame, Id};

/// COB-ID of SYNC.
pub const COB_ID: Id = Id::standard(0x080);

/// The frame.
pub const FRAME: CanFrame = CanFrame::new(COB_ID, []);
