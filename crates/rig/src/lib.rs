//! Rigs: a simulated stage or real devices, optionally corrected by a calibration; emulated devices for a rehearsal without
//! hardware; and the thermal state of the motor between runs.

#![deny(unsafe_code)]

pub mod calibration;
pub mod devices;
pub mod emulator;
pub mod motor;
pub mod simulated;
