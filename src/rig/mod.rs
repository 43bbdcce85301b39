//! Rigs: a simulated stage or real devices, optionally corrected by a calibration; and emulated devices for a
//! rehearsal without hardware.

pub mod calibration;
pub mod devices;
pub mod emulator;
pub mod simulated;
