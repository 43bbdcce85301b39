//! Emulated amplifiers: a CANopen drive and a VESC, for tests and rehearsals without hardware.
//!
//! Both implement [`EmulatedAmplifier`]: frames and the time go in, frames come out. [`AmplifierTask`] connects one to a bus.
//! They are written from the standards and the manual, not from the drivers, so that each side tests the other.
//!
//! The main result is [`EmulatedAmplifier::current_a`], the current that a real device would give. It is quantised as in the
//! device, and zero unless the power stage is enabled.

mod amplifier;
mod dictionary;
mod drive;
mod drive_objects;
mod fault;
mod pdo;
mod power_stage;
mod task;
mod vesc;

pub use amplifier::EmulatedAmplifier;
pub use dictionary::ObjectDictionary;
pub use drive::EmulatedDrive;
pub use drive_objects::EmulatedDriveSettings;
pub use fault::DeviceFault;
pub use task::{AmplifierTask, FrameCounts, Observer};
pub use vesc::EmulatedVesc;
