//! Displacement probes over a serial port.
//!
//! [`capancdt`], [`optoncdt`], [`ascii`]: what the probes say, byte by byte, for both sides of the line; no clock, no port.

pub mod ascii;
pub mod capancdt;
mod error;
mod event;
pub mod optoncdt;
mod pattern;

pub use error::SerialError;
pub use event::{Decoder, Event, Sample};
