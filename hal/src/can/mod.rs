//! Devices on a CAN bus: a CANopen drive (CiA 301, CiA 402) and a VESC.
//!
//! ```text
//!  frame            a CAN frame, independent of sockets
//!  sdo nmt heartbeat emcy sync pdo cia402     codecs and state machines, without input or output
//!  budget scale     what fits on the bus; amperes and counts
//!  bus              where frames go: SocketCAN, or a bus in memory with real or virtual time
//!  drive  vesc      the two drivers: bench_hal::CurrentAmplifier
//!  emulator         emulated devices, for tests and rehearsals
//! ```
//!
//! # How the current is stopped
//!
//! | failure of | detected by | by |
//! |---|---|---|
//! | the loop (no more set-points) | the service thread | [`drive::DriveTimes::command_timeout`], [`vesc::VescSettings::command_timeout`] |
//! | the service thread | the loop | the age of its last pass, 20 ms |
//! | this process | the drive | its heartbeat consumer (0x1016) and abort connection option (0x6007) |
//! | the drive's processor, its power | the service thread | heartbeat, boot-up message |
//! | the drive's power stage | the service thread | EMCY, statusword |
//! | the bus, the adapter | both ends | error frames here, heartbeat there |
//!
//! A successful write is no evidence of a working bus, because SocketCAN accepts frames in bus-off. Only received
//! frames are evidence.

pub mod budget;
pub mod bus;
pub mod cia402;
pub mod drive;
pub mod emcy;
pub mod emulator;
pub mod frame;
pub mod heartbeat;
mod last_pass;
pub mod nmt;
mod objects;
pub mod pdo;
pub mod scale;
pub mod sdo;
pub mod sync;
pub mod vesc;

pub use frame::{CanFrame, Id};
