//! Opens a serial port and checks which settings it accepted.

use std::io::{self, Read, Write};
use std::os::linux::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serialport::{ClearBuffer, ErrorKind, SerialPort, TTYPort};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::error::SerialError;
use super::ioctl;
use super::lock::PortLock;
use super::note::Note;

/// Parity of a character.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Parity {
    /// 8N1: ten bits per character.
    #[default]
    None,
    /// 8E1: eleven bits per character.
    Even,
}

impl Parity {
    fn to_serialport(self) -> serialport::Parity {
        match self {
            Self::None => serialport::Parity::None,
            Self::Even => serialport::Parity::Even,
        }
    }

    /// Start, data, parity and stop bits of a character.
    fn bits(self) -> u64 {
        match self {
            Self::None => 10,
            Self::Even => 11,
        }
    }
}

/// A port and its line settings. Eight data bits, one stop bit, no flow control.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PortSettings {
    /// The device. A link in /dev/serial/by-id keeps its name when the adapters are connected in another order.
    #[serde(rename = "port")]
    #[schemars(length(min = 1, max = 4095))]
    pub path: PathBuf,
    /// Baud rate in bit/s; any number that the port supports.
    #[schemars(range(min = 300, max = 12000000))]
    pub baud: u32,
    /// Parity.
    #[serde(default)]
    pub parity: Parity,
    /// Request low latency from the driver. Without it USB adapters collect bytes for up to 16 ms.
    #[serde(default = "low_latency")]
    pub low_latency: bool,
    /// Folder of the lock files.
    #[serde(rename = "lock_folder", default = "lock_dir")]
    pub lock_dir: PathBuf,
}

fn low_latency() -> bool {
    true
}

fn lock_dir() -> PathBuf {
    "/run/lock".into()
}

impl PortSettings {
    /// A port with 8N1, low latency and lock files in /run/lock.
    pub fn new(path: impl Into<PathBuf>, baud: u32) -> Self {
        Self {
            path: path.into(),
            baud,
            parity: Parity::None,
            low_latency: low_latency(),
            lock_dir: lock_dir(),
        }
    }

    /// Time in nanoseconds that `bytes` take on the line.
    pub fn line_time_ns(&self, bytes: u32) -> u64 {
        u64::from(bytes) * self.parity.bits() * 1_000_000_000 / u64::from(self.baud.max(1))
    }
}

/// An open port, locked for this process.
pub(super) struct Port {
    terminal: TTYPort,
    _lock: PortLock,
}

impl Port {
    /// Locks, opens and checks the port. The notes name the settings that it did not accept.
    pub(super) fn open(settings: &PortSettings) -> Result<(Self, Vec<Note>), SerialError> {
        super::error::positive("baud", settings.baud.into())?;
        let path = &settings.path;
        let device = path
            .canonicalize()
            .map_err(|source| open_error(path, source.into()))?;
        let lock = PortLock::take(&settings.lock_dir, path, &device)?;
        let terminal = open_terminal(settings, &device).map_err(|e| open_error(path, e))?;
        ioctl::do_not_block(&terminal).map_err(|source| open_error(path, source.into()))?;
        let mut notes = check_line(settings, &terminal, &device)?;
        // The age of bytes that arrived before is unknown.
        terminal
            .clear(ClearBuffer::Input)
            .map_err(|source| open_error(path, source))?;
        if settings.low_latency {
            notes.extend(ioctl::request_low_latency(&terminal).err());
        }
        let port = Self {
            terminal,
            _lock: lock,
        };
        Ok((port, notes))
    }

    /// Reads bytes that arrive within `wait`; 0 if there are none. An error means that the port is lost.
    pub(super) fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        set_timeout(&mut self.terminal, wait)?;
        match self.terminal.read(buffer) {
            Ok(0) => Err(io::ErrorKind::BrokenPipe.into()),
            Err(error) if is_no_data(&error) => Ok(0),
            other => other,
        }
    }

    /// Writes all `bytes`; an error if there is no space within `wait`.
    pub(super) fn write(&mut self, bytes: &[u8], wait: Duration) -> io::Result<()> {
        set_timeout(&mut self.terminal, wait)?;
        self.terminal.write_all(bytes)
    }
}

fn set_timeout(terminal: &mut TTYPort, wait: Duration) -> io::Result<()> {
    terminal.set_timeout(wait).map_err(io::Error::from)
}

pub(super) fn is_no_data(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::TimedOut | io::ErrorKind::Interrupted | io::ErrorKind::WouldBlock
    )
}

/// The baud rate and parity that the port accepted; notes for what differs without harm.
fn check_line(
    settings: &PortSettings,
    terminal: &TTYPort,
    device: &Path,
) -> Result<Vec<Note>, SerialError> {
    let path = &settings.path;
    let parity = terminal
        .parity()
        .map_err(|source| open_error(path, source))?;
    let baud = terminal
        .baud_rate()
        .map_err(|source| open_error(path, source))?;
    check_baud(settings, baud)?;
    let note = check_parity(settings, parity, is_pseudo_terminal(device))?;
    Ok(note.into_iter().collect())
}

fn open_terminal(settings: &PortSettings, device: &Path) -> serialport::Result<TTYPort> {
    let builder = serialport::new(device.to_string_lossy(), settings.baud);
    TTYPort::open(&builder.parity(settings.parity.to_serialport()))
}

/// Converts an error of the serial-port library.
fn open_error(path: &Path, source: serialport::Error) -> SerialError {
    let path = path.to_owned();
    match source.kind() {
        ErrorKind::Io(io::ErrorKind::NotFound) => SerialError::Missing { path },
        ErrorKind::Io(io::ErrorKind::PermissionDenied) => SerialError::Permission { path },
        ErrorKind::NoDevice => SerialError::PortInUse { path, pid: None },
        _ => SerialError::Open { path, source },
    }
}

/// Whether the device is the slave of a pseudo terminal: majors 136 to 143 [Linux, admin-guide/devices.txt].
fn is_pseudo_terminal(device: &Path) -> bool {
    std::fs::metadata(device)
        .is_ok_and(|device| (136..=143).contains(&libc::major(device.st_rdev())))
}

/// Compares the parity of the port with the setting. A pseudo terminal accepts even parity but always reads back no
/// parity: this gives a note. On other ports a difference is an error.
fn check_parity(
    settings: &PortSettings,
    got: serialport::Parity,
    pseudo_terminal: bool,
) -> Result<Option<Note>, SerialError> {
    if got == settings.parity.to_serialport() {
        return Ok(None);
    }
    if pseudo_terminal {
        let what = format!(
            "{}: a pseudo terminal has no parity: {:?} was ignored",
            settings.path.display(),
            settings.parity
        );
        return Ok(Some(Note {
            what,
            remedy: "errors that parity would detect are not detected; a real port has parity",
        }));
    }
    Err(SerialError::NotTaken {
        path: settings.path.clone(),
        what: "parity",
        asked: format!("{:?}", settings.parity),
        got: format!("{got:?}"),
        remedy: "use an adapter that supports it",
    })
}

/// A receiver must sample the last of ten bits within half a bit, 5 %. A limit of 2 % leaves room for the error of the probe.
fn check_baud(settings: &PortSettings, got: u32) -> Result<(), SerialError> {
    if got.abs_diff(settings.baud) <= settings.baud / 50 {
        return Ok(());
    }
    Err(SerialError::NotTaken {
        path: settings.path.clone(),
        what: "baud",
        asked: settings.baud.to_string(),
        got: got.to_string(),
        remedy: "use an adapter that supports it, or set probe and port to a rate that both support",
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn even() -> PortSettings {
        PortSettings {
            parity: Parity::Even,
            ..PortSettings::new("/dev/ttyX", 230_400)
        }
    }

    #[test]
    fn ignored_parity_is_a_note_on_a_pseudo_terminal_and_an_error_elsewhere() {
        let note = check_parity(&even(), serialport::Parity::None, true)
            .unwrap()
            .unwrap();
        assert!(note.what.contains("Even was ignored"), "{note:?}");
        let error = check_parity(&even(), serialport::Parity::None, false)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("parity Even was requested, but the port has None"),
            "{error}"
        );
        assert_eq!(
            check_parity(&even(), serialport::Parity::Even, false).unwrap(),
            None
        );
    }

    #[test]
    fn distinguishes_the_errors_of_the_system() {
        let of = |kind| {
            open_error(
                Path::new("/dev/ttyX"),
                serialport::Error::new(kind, "words"),
            )
        };
        assert!(matches!(
            of(ErrorKind::Io(io::ErrorKind::PermissionDenied)),
            SerialError::Permission { .. }
        ));
        assert!(matches!(
            of(ErrorKind::Io(io::ErrorKind::NotFound)),
            SerialError::Missing { .. }
        ));
        assert!(matches!(
            of(ErrorKind::NoDevice),
            SerialError::PortInUse { pid: None, .. }
        ));
        assert!(matches!(of(ErrorKind::Unknown), SerialError::Open { .. }));
    }

    #[test]
    fn rejects_a_baud_rate_that_differs_by_two_percent() {
        assert!(check_baud(&even(), 230_400 + 4_608).is_ok());
        let error = check_baud(&even(), 225_000).unwrap_err().to_string();
        assert!(
            error.contains("230400") && error.contains("225000"),
            "{error}"
        );
    }

    #[test]
    fn line_time_counts_all_bits_of_a_character() {
        // 17 x 11 / 230400 s = 811.6 us
        assert_eq!(even().line_time_ns(17), 811_631);
        assert_eq!(PortSettings::new("", 921_600).line_time_ns(3), 32_552);
    }
}
