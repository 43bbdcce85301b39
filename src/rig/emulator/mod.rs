//! The other end: devices that act as the configured ones, on a real bus and a real line, with the simulated stage behind
//! them in real time. `bench device` serves them.
//!
//! ```text
//!  bench control                                       bench device
//!    CanopenDrive | Vesc  <==== CAN interface ====>  amplifier.rs --set-points--> stage.rs (sim::LiveStage)
//!    SerialProbe          <==== serial line ======>  probe.rs     <--position----    |
//!                                                     fault.rs, schedule.rs: what goes wrong, when
//!                                                     journal.rs: every change, with its time
//! ```
//!
//! The devices themselves are those of [`bench_hal`]: this room gives them their settings, a stage, and faults on request.

pub mod amplifier;
pub mod fault;
pub mod journal;
mod link;
pub mod probe;
pub mod rehearsal;
pub mod schedule;
mod stage;

use std::path::PathBuf;

use bench_hal::can::bus::{BusError, NodeInUse, PortError};
use bench_hal::serial::SerialError;

use crate::model::plant::PlantError;

pub use amplifier::Amplifier;
pub use fault::{AmplifierFault, EmulatedFault};
pub use journal::{EventLog, LogEntry};
pub use probe::Probe;
pub use rehearsal::{Emulator, Summary};
pub use schedule::FaultSchedule;
pub use stage::Stage;

/// A device that cannot act.
#[derive(Debug, thiserror::Error)]
pub enum EmulatorError {
    /// The configuration names none.
    #[error(
        "{device}.device is `simulated`: there is nothing to act for; name real devices, as --config lab does"
    )]
    Simulated {
        /// `amplifier` or `probe`.
        device: &'static str,
    },
    /// The model of the stage cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The CAN interface cannot be used.
    #[error(
        "{0}; for a rehearsal on this computer alone: `ip link add vcan0 type vcan`, `ip link set vcan0 up`, and --interface vcan0"
    )]
    Port(#[from] PortError),
    /// The CAN interface failed.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// Another process acts as this device.
    #[error("on {interface}, {held}")]
    NodeInUse {
        /// The interface.
        interface: String,
        /// Who.
        held: NodeInUse,
    },
    /// The serial line.
    #[error(transparent)]
    Serial(#[from] SerialError),
    /// The link to the terminal cannot be made.
    #[error("cannot make the link {}: {why}; remove what is there, or choose another name with --pty", path.display())]
    Link {
        /// The link.
        path: PathBuf,
        /// What is in the way.
        why: String,
    },
    /// A fault that this device cannot have.
    #[error("a {kind} cannot have the fault {word}; `bench device --help` lists them")]
    Fault {
        /// Kind of the device, as in a configuration.
        kind: &'static str,
        /// The fault.
        word: String,
    },
    /// A fault of a device that is not served.
    #[error("{word}: no {device} is served here; name it on the command line")]
    NotServed {
        /// The fault.
        word: String,
        /// `amplifier` or `probe`.
        device: &'static str,
    },
    /// The system refused a thread.
    #[error(
        "cannot start the thread of the {device}: {source}; raise the limit of processes (ulimit -u)"
    )]
    Thread {
        /// Which device.
        device: &'static str,
        /// The system's words.
        source: std::io::Error,
    },
}
