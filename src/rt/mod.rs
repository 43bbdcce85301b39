//! The real-time loop.
//!
//! ```text
//!            orders (ring)                       records, events (ring)
//!  supervisor ----------->  Servo::tick  ------------------------------>  recorder
//!             <-----------    read -> check -> decide -> write -> publish
//!             spent programs (ring)
//! ```
//!
//! [`servo`] is the loop itself, [`interlock`] and [`arming`] its safety, [`clock`] its two paces, [`program`] what it
//! runs, [`record`] what it says.

pub mod arming;
pub mod clock;
mod following;
pub mod interlock;
pub mod outlet;
pub mod program;
pub mod record;
pub mod servo;
pub mod thread;
