//! What the daemon shows while the loop runs: samples, state and events, derived outside the loop from its messages.
//!
//! ```text
//!  loop -> ring -> recorder -> ring (a copy; what does not fit is counted) -> hub -> samples, events, status -> clients
//!  loop between two runs ----> ring ------------------------------------------^
//! ```

pub mod event_text;
pub mod frame;
mod history;
pub mod hub;
pub mod response;
pub mod status;
