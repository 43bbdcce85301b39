//! The real-time loop.
//!
//! ```text
//!            requests (ring)                     records, events (ring)
//!  supervisor ----------->  Servo::tick  ------------------------------>  recorder
//!             <-----------    read -> check -> decide -> write -> publish
//!            retired programs (ring)
//! ```
//!
//! [`servo`] is the loop itself, [`interlock`] and [`arming`] its safety, [`settling`] the end of a run, [`clock`] its two paces, [`program`] what it
//! runs, [`record`] what it publishes, [`request`] what it is asked to do,
//! [`supervision`] what ends a run without a request.

pub mod arming;
pub mod clock;
mod following_error;
pub mod interlock;
pub mod program;
pub mod publisher;
pub mod record;
pub mod request;
pub mod servo;
pub mod settling;
pub mod supervision;
pub mod thread;
mod trip;
