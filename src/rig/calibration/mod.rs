//! What small static steps say of amplifier and probe, and how a run takes it into account.
//!
//! ```text
//!  bench calibrate: Staircase -> recording -> fit -> Calibration (a file of its own)
//!                                                        |
//!  [calibration] file = ... ----> valid? this device's? --> CalibratedRig: position = gain (reading) + offset,
//!                                                                          command / current gain to the amplifier
//! ```
//!
//! # What steps can tell, and what not
//!
//! The slope of the reading over the command is the compliance of the whole chain: amplifier, motor, springs, probe. Its sign
//! is that of the chain, and a calibration turns the probe's reading so that positive current moves the stage positively.
//! The amplifier's own scale follows where it says which current flows. The probe's scale follows only from a
//! displacement that is known otherwise: the model's compliance, if the springs are known better than the probe.

mod file;
mod rig;

pub use file::{
    AmplifierCalibration, Calibration, CalibrationError, ChainCalibration, ProbeCalibration,
    load_calibration,
};
pub use rig::CalibratedRig;
