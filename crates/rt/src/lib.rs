//! The real-time loop.
//!
//! ```text
//!            requests (ring)                     records, events (ring)
//!  supervisor ----------->  Servo::tick  ------------------------------>  recorder
//!             <-----------    read -> check -> decide -> write -> publish
//!            retired programs (ring)
//! ```
//!
//! [`servo`] is the loop itself, [`servo_run`] what belongs to one run of it, [`live_loop`] its thread, which serves runs as long as
//! the rig is open, [`thread`] how the system schedules it. [`interlock`], [`residual`] and [`arming`] are its safety, [`settling`] the end of a
//! run, [`device_defect`] whether the devices can be used, [`clock`] its two paces, [`program`] what it runs, [`record`] what it publishes, [`request`] what it is asked to do,
//! [`supervision`] what ends a run without a request, [`tuning`] what changes a run in progress.

#![deny(unsafe_code)]

pub mod arming;
pub mod clock;
pub mod device_defect;
mod following_error;
pub mod interlock;
pub mod live_loop;
pub mod program;
pub mod publisher;
pub mod record;
pub mod request;
pub mod residual;
pub mod servo;
pub mod servo_run;
pub mod settling;
pub mod supervision;
pub mod thread;
mod trip;
pub mod tuning;
