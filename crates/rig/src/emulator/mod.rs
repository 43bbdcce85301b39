//! Emulated devices: they behave as the configured ones, on a real bus and a real line, with the simulated stage behind them in
//! real time. `bench emulate` serves them.
//!
//! ```text
//!  bench control                                       bench emulate
//!    CanopenDrive | Vesc  <==== CAN interface ====>  amplifier.rs --current----> stage.rs (LiveStage)
//!    SerialProbe          <==== serial line ======>  probe.rs     <--position----    |
//!                                                     fault.rs, fault_schedule.rs: faults and their times
//!                                                     event_log.rs: every change, with its time
//! ```
//!
//! The devices themselves are those of [`bench_hal`]. This module gives them their settings, the stage, and faults.

pub mod amplifier;
mod emulated_bench;
pub mod event_log;
pub mod fault;
pub mod fault_schedule;
mod link;
pub mod probe;
mod stage;

use std::fmt;
use std::path::PathBuf;

use bench_hal::can::bus::{BusError, NodeInUse, PortError};
use bench_hal::serial::SerialError;
use serde::Serialize;

use bench_plant::PlantError;

pub use amplifier::AmplifierServer;
pub use emulated_bench::{EmulatedDevices, Emulator, Summary};
pub use event_log::{EventLog, LogEntry, LogEvent};
pub use fault::{AmplifierFault, EmulatedFault, FaultRequest};
pub use fault_schedule::{FaultSchedule, PlannedFault};
pub use probe::{ProbeEndpoint, ProbeServer};
pub use stage::Stage;

/// A device that can be emulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum EmulatedDevice {
    /// The amplifier, on a CAN interface
    Amplifier,
    /// The probe, on a serial line
    Probe,
}

impl EmulatedDevice {
    /// The name in the log and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            EmulatedDevice::Amplifier => "amplifier",
            EmulatedDevice::Probe => "probe",
        }
    }
}

impl fmt::Display for EmulatedDevice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A device that cannot be emulated, or a fault that it cannot have.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum EmulatorError {
    /// The configuration names no device.
    #[error(
        "{device}.device is `simulated`, so there is no device to emulate; choose a configuration with real devices, for example --config lab"
    )]
    Simulated {
        /// The device.
        device: EmulatedDevice,
    },
    /// The model of the stage cannot be analysed.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The CAN interface cannot be used.
    #[error(
        "{0}; for a test on this computer without hardware use \
         `ip link add vcan0 type vcan`, `ip link set vcan0 up`, and --interface vcan0"
    )]
    Port(#[from] PortError),
    /// The CAN interface failed.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// Another process emulates this device.
    #[error("on {interface}, {holder}")]
    NodeInUse {
        /// The interface.
        interface: String,
        /// Node and process.
        holder: NodeInUse,
    },
    /// The serial line.
    #[error(transparent)]
    Serial(#[from] SerialError),
    /// The link to the terminal cannot be made.
    #[error("cannot create the link {}: {why}; \
        remove the existing file, or choose another name with --pty", path.display())]
    Link {
        /// The link.
        path: PathBuf,
        /// The reason.
        why: String,
    },
    /// A fault that this device cannot have.
    #[error(
        "a {kind} cannot have the fault {fault}; choose one from the list in `bench emulate --help`"
    )]
    Fault {
        /// Kind of the device, as in a configuration.
        kind: &'static str,
        /// The fault.
        fault: String,
    },
    /// A fault of a device that is not emulated.
    #[error("{fault}: no {device} is emulated; add it on the command line")]
    NotEmulated {
        /// The fault.
        fault: String,
        /// The device that could have it.
        device: EmulatedDevice,
    },
    /// The system refused a thread.
    #[error(
        "cannot start the thread of the {device}: {source}; raise the limit of processes (ulimit -u)"
    )]
    Thread {
        /// The device.
        device: EmulatedDevice,
        /// The error of the system.
        source: std::io::Error,
    },
}
