//! The real-time loop.
pub mod arming;
pub mod record;
