//! Errors of a serial port, each with its remedy.

use std::path::PathBuf;

use crate::DeviceError;

/// Why a probe could not be opened. Each message ends with the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SerialError {
    /// A setting is invalid.
    #[error("setting {name} = {value} is invalid; give {expected}")]
    Setting {
        /// The setting.
        name: &'static str,
        /// Its value.
        value: String,
        /// The valid values.
        expected: &'static str,
    },
    /// The device does not exist.
    #[error("{}: there is no such port; connect the adapter, and look in /dev/serial/by-id for the ports that exist", path.display())]
    Missing {
        /// The port as configured.
        path: PathBuf,
    },
    /// The user may not open the device.
    #[error(
        "{}: permission denied; join the group that owns it (`ls -l` shows it, often dialout) and log in again, \
         or add a udev rule with TAG+=\"uaccess\"",
        path.display()
    )]
    Permission {
        /// The port as configured.
        path: PathBuf,
    },
    /// Another process uses the port.
    #[error(
        "{}: in use by {}; end that process first, because each of two readers loses bytes",
        path.display(),
        pid.map_or("another process".to_string(), |pid| format!("process {pid}"))
    )]
    PortInUse {
        /// The port as configured.
        path: PathBuf,
        /// The process, if it is known.
        pid: Option<u32>,
    },
    /// The lock file cannot be written.
    #[error("lock file {}: {source}; set lock_dir to a directory that every user of the port can write", path.display())]
    Lock {
        /// The lock file.
        path: PathBuf,
        /// The system error.
        source: std::io::Error,
    },
    /// The port did not accept a line setting.
    #[error("{}: {what} {asked} was requested, but the port has {got}; {remedy}", path.display())]
    NotTaken {
        /// The port as configured.
        path: PathBuf,
        /// The line setting.
        what: &'static str,
        /// The configured value.
        asked: String,
        /// The value of the port.
        got: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The device is not a serial port.
    #[error("{}: cannot be opened as a serial port ({source}); check that it is a terminal device", path.display())]
    Open {
        /// The port as configured.
        path: PathBuf,
        /// Error of the serial-port library.
        source: serialport::Error,
    },
    /// The start command could not be sent.
    #[error("{}: the start command could not be sent ({source}); check adapter and cable", path.display())]
    Start {
        /// The port as configured.
        path: PathBuf,
        /// The system error.
        source: std::io::Error,
    },
    /// The reader thread could not be started.
    #[error(
        "cannot start the reader thread of the port: {source}; raise the limit of processes (ulimit -u)"
    )]
    Thread {
        /// The system error.
        source: std::io::Error,
    },
    /// The protocol has no emulated probe.
    #[error(
        "this protocol has no emulated probe; implement Protocol::responder, or use a protocol that has one"
    )]
    NoEmulator,
}

/// Refuses a setting that is not a finite number above zero.
pub(super) fn positive(name: &'static str, value: f64) -> Result<(), SerialError> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(SerialError::Setting {
        name,
        value: value.to_string(),
        expected: "a finite number above zero",
    })
}

/// A failure while the probe is open, as a number that fits an atomic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Failure {
    Read = 1,
    Write,
    HangUp,
    Timeout,
    Restart,
}

impl Failure {
    const ALL: [Self; 5] = [
        Self::Read,
        Self::Write,
        Self::HangUp,
        Self::Timeout,
        Self::Restart,
    ];

    /// The error of this number; `None` for 0, no failure.
    pub(super) fn describe(number: u32, code: i64) -> Option<DeviceError> {
        let failure = Self::ALL
            .into_iter()
            .find(|failure| *failure as u32 == number)?;
        let (what, remedy) = failure.text();
        Some(DeviceError { what, remedy, code })
    }

    fn text(self) -> (&'static str, &'static str) {
        match self {
            Self::Read => (
                "the serial port cannot be read",
                "see the kernel log for the adapter, then open the probe again",
            ),
            Self::Write => (
                "the request cannot be written to the serial port",
                "check adapter and cable, then open the probe again",
            ),
            Self::HangUp => (
                "the serial port is gone",
                "connect the cable, then open the probe again",
            ),
            Self::Timeout => (
                "the probe did not answer",
                "check its power, wiring, address, baud rate and parity",
            ),
            Self::Restart => (
                "the counter of the probe went back: the probe restarted",
                "check the supply of the probe",
            ),
        }
    }
}
