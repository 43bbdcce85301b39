//! Everything that can be wrong with a serial port, with what to do about it.

use std::path::PathBuf;

use crate::DeviceError;

/// Why a probe cannot be opened. Each text ends with the remedy.
#[derive(Debug, thiserror::Error)]
pub enum SerialError {
    /// A setting makes no sense.
    #[error("setting {name} = {value}: it must be {wants}")]
    Setting {
        /// Which setting.
        name: &'static str,
        /// Its value.
        value: String,
        /// What it must be.
        wants: &'static str,
    },
    /// There is no such device.
    #[error("{}: there is no such port; plug the adapter in, and see /dev/serial/by-id for what is there", path.display())]
    Missing {
        /// The port as configured.
        path: PathBuf,
    },
    /// The user may not open it.
    #[error(
        "{}: permission denied; join the group that owns it (`ls -l` shows it, often dialout) and log in again, \
         or add a udev rule with TAG+=\"uaccess\"",
        path.display()
    )]
    Permission {
        /// The file that was refused.
        path: PathBuf,
    },
    /// Another process holds the port.
    #[error(
        "{}: held by {}; stop that first, two readers would take each other's bytes",
        path.display(),
        pid.map_or("another process".to_string(), |pid| format!("process {pid}"))
    )]
    PortInUse {
        /// The port as configured.
        path: PathBuf,
        /// Who holds it, if it says so.
        pid: Option<u32>,
    },
    /// The lock file cannot be written.
    #[error("lock file {}: {source}; set lock_dir to a directory that every user of the port can write", path.display())]
    Lock {
        /// The lock file.
        path: PathBuf,
        /// The system's words.
        source: std::io::Error,
    },
    /// The port did not take a setting of the line.
    #[error("{}: {what} {asked} was asked for, the port has {got}; {remedy}", path.display())]
    NotTaken {
        /// The port as configured.
        path: PathBuf,
        /// Which setting of the line.
        what: &'static str,
        /// What was asked for.
        asked: String,
        /// What the port says it has.
        got: String,
        /// What to do.
        remedy: &'static str,
    },
    /// The port cannot be set up as a serial port.
    #[error("{}: cannot be opened as a serial port ({source}); is it a terminal device?", path.display())]
    Open {
        /// The port as configured.
        path: PathBuf,
        /// The library's words.
        source: serialport::Error,
    },
    /// No thread for the reader.
    #[error(
        "no thread for the reader of the port: {source}; raise the limit of processes (ulimit -u)"
    )]
    Thread {
        /// The system's words.
        source: std::io::Error,
    },
}

/// Refuses a setting that is not a finite number above zero.
pub(super) fn positive(name: &'static str, value: f64) -> Result<(), SerialError> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(SerialError::Setting {
        name,
        value: value.to_string(),
        wants: "a finite number above zero",
    })
}

/// What went wrong while running, as a number that fits an atomic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u32)]
pub(super) enum Trouble {
    ReadFailed = 1,
    WriteFailed,
    HungUp,
    Timeout,
    Restart,
}

impl Trouble {
    const ALL: [Self; 5] = [
        Self::ReadFailed,
        Self::WriteFailed,
        Self::HungUp,
        Self::Timeout,
        Self::Restart,
    ];

    /// The error of this number; `None` if there was none.
    pub(super) fn describe(number: u32, code: i64) -> Option<DeviceError> {
        let trouble = Self::ALL
            .into_iter()
            .find(|trouble| *trouble as u32 == number)?;
        let (what, remedy) = trouble.words();
        Some(DeviceError { what, remedy, code })
    }

    fn words(self) -> (&'static str, &'static str) {
        match self {
            Self::ReadFailed => (
                "the serial port cannot be read",
                "see the kernel's log for the adapter; open the probe again",
            ),
            Self::WriteFailed => (
                "the serial port takes no request",
                "check adapter and cable; open the probe again",
            ),
            Self::HungUp => (
                "the serial port is gone",
                "plug the cable in and open the probe again",
            ),
            Self::Timeout => (
                "the probe did not answer",
                "check its power, wiring, address, baud rate and parity",
            ),
            Self::Restart => (
                "the probe's counter went back: it restarted",
                "check the probe's supply",
            ),
        }
    }
}
