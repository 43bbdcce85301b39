//! The calibration of amplifier and probe: its file, and the correction of commands and readings.
//!
//! ```text
//!  bench calibrate: staircase -> recording -> fit -> Calibration (a file)
//!                                                         |
//!  [calibration] file = ... -----> valid? of these devices? --> Correction in the loop, above the interlocks:
//!                                                               position = gain * reading + offset,
//!                                                               set-point of the amplifier = (current - offset) / gain
//! ```
//!
//! # What small static steps can determine
//!
//! The slope of the reading over the command is the compliance of the whole chain: amplifier, motor, springs and probe. From its
//! sign the calibration corrects the sign of the probe, so that positive current gives positive displacement. The scale of the
//! amplifier follows if it measures its current. The scale of the probe follows only from an independently known
//! displacement: the compliance of the model, if the stiffness of the springs is known better than the scale of the probe.

mod correction;
mod file;

pub use correction::Correction;
pub use file::{
    AmplifierCalibration, Calibration, CalibrationDefect, CalibrationError, ChainCalibration,
    KnownDevices, LoadedCalibration, ProbeCalibration, load_calibration,
};
