//! What the loop drives: a simulated stage, real devices, either of them corrected by a calibration, and emulated devices
//! for a rehearsal without hardware.

pub mod calibration;
pub mod devices;
pub mod emulator;
pub mod simulated;
