//! Opening a serial port, and saying what it did not take.

use std::io::{self, Read, Write};
use std::os::fd::AsRawFd;
use std::os::linux::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serialport::{ClearBuffer, ErrorKind, SerialPort, TTYPort};

use super::error::SerialError;
use super::lock::PortLock;
use super::low_latency;

/// Parity of a character.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Parity {
    /// 8N1: ten bits a character.
    #[default]
    None,
    /// 8E1: eleven bits a character.
    Even,
}

impl Parity {
    fn asked(self) -> serialport::Parity {
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

/// A port and its line. Eight data bits, one stop bit, no flow control.
#[derive(Clone, Debug, PartialEq)]
pub struct PortSettings {
    /// The device; a link below /dev/serial/by-id keeps its name when adapters are plugged in another order.
    pub path: PathBuf,
    /// Bits a second. Any number: 230400 and 921600 need no table.
    pub baud: u32,
    /// Parity.
    pub parity: Parity,
    /// Ask the driver to hand over bytes at once. Without it USB adapters collect them for up to 16 ms.
    pub low_latency: bool,
    /// Where the lock files are.
    pub lock_dir: PathBuf,
}

impl PortSettings {
    /// This port at this rate, 8N1, low latency, locks in /run/lock.
    pub fn new(path: impl Into<PathBuf>, baud: u32) -> Self {
        Self {
            path: path.into(),
            baud,
            parity: Parity::None,
            low_latency: true,
            lock_dir: "/run/lock".into(),
        }
    }

    /// Nanoseconds for which `bytes` keep the line busy.
    pub fn line_time_ns(&self, bytes: u32) -> u64 {
        u64::from(bytes) * self.parity.bits() * 1_000_000_000 / u64::from(self.baud.max(1))
    }
}

/// Something about an open port that a person should know; reading works nevertheless.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Note {
    /// What is not as asked for.
    pub what: String,
    /// What that means, or what to do.
    pub remedy: &'static str,
}

/// An open port that is ours alone.
pub(super) struct Port {
    terminal: TTYPort,
    _lock: PortLock,
}

impl Port {
    /// Locks, opens and checks the port; returns it with what it did not take.
    pub(super) fn open(settings: &PortSettings) -> Result<(Self, Vec<Note>), SerialError> {
        super::error::positive("baud", settings.baud.into())?;
        let path = &settings.path;
        let device = path
            .canonicalize()
            .map_err(|source| refused(path, source.into()))?;
        let lock = PortLock::take(&settings.lock_dir, path, &device)?;
        let builder = serialport::new(device.to_string_lossy(), settings.baud)
            .parity(settings.parity.asked());
        let terminal = TTYPort::open(&builder).map_err(|source| refused(path, source))?;
        let mut notes = Vec::new();
        let pseudo = is_pseudo_terminal(&device);
        let got = terminal.parity().map_err(|source| refused(path, source))?;
        notes.extend(parity_note(settings, got, pseudo)?);
        check_baud(
            settings,
            terminal
                .baud_rate()
                .map_err(|source| refused(path, source))?,
        )?;
        // What arrived before we listened is of unknown age.
        terminal
            .clear(ClearBuffer::Input)
            .map_err(|source| refused(path, source))?;
        if settings.low_latency {
            notes.extend(low_latency::ask(terminal.as_raw_fd()).err());
        }
        Ok((
            Self {
                terminal,
                _lock: lock,
            },
            notes,
        ))
    }

    /// Bytes that arrive within `wait`, at most as many as fit; 0 if none do. An error means that the port is lost.
    pub(super) fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        set_timeout(&mut self.terminal, wait)?;
        match self.terminal.read(buffer) {
            Ok(0) => Err(io::ErrorKind::BrokenPipe.into()),
            Err(error) if is_nothing(&error) => Ok(0),
            other => other,
        }
    }

    /// Sends all `bytes` or fails.
    pub(super) fn write(&mut self, bytes: &[u8], wait: Duration) -> io::Result<()> {
        set_timeout(&mut self.terminal, wait)?;
        self.terminal.write_all(bytes)
    }
}

fn set_timeout(terminal: &mut TTYPort, wait: Duration) -> io::Result<()> {
    terminal.set_timeout(wait).map_err(io::Error::from)
}

pub(super) fn is_nothing(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        io::ErrorKind::TimedOut | io::ErrorKind::Interrupted | io::ErrorKind::WouldBlock
    )
}

/// The library's error in our words.
fn refused(path: &Path, source: serialport::Error) -> SerialError {
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

/// A pseudo terminal takes even parity without a word and reads back none; elsewhere that is an error.
fn parity_note(
    settings: &PortSettings,
    got: serialport::Parity,
    pseudo_terminal: bool,
) -> Result<Option<Note>, SerialError> {
    if got == settings.parity.asked() {
        return Ok(None);
    }
    if pseudo_terminal {
        let what = format!(
            "{}: a pseudo terminal has no parity: {:?} was dropped",
            settings.path.display(),
            settings.parity
        );
        return Ok(Some(Note {
            what,
            remedy: "damage that parity would catch goes unseen here; a real port has it",
        }));
    }
    Err(SerialError::NotTaken {
        path: settings.path.clone(),
        what: "parity",
        asked: format!("{:?}", settings.parity),
        got: format!("{got:?}"),
        remedy: "use an adapter that can do it",
    })
}

/// A receiver samples the last bit of a character within half a bit: 2 % of ten bits leave room for the probe's own error.
fn check_baud(settings: &PortSettings, got: u32) -> Result<(), SerialError> {
    if got.abs_diff(settings.baud) <= settings.baud / 50 {
        return Ok(());
    }
    Err(SerialError::NotTaken {
        path: settings.path.clone(),
        what: "baud",
        asked: settings.baud.to_string(),
        got: got.to_string(),
        remedy: "use an adapter that can do it, or set probe and port to a rate both have",
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
    fn parity_dropped_by_a_pseudo_terminal_is_said_and_elsewhere_refused() {
        let note = parity_note(&even(), serialport::Parity::None, true)
            .unwrap()
            .unwrap();
        assert!(note.what.contains("Even was dropped"), "{note:?}");
        let error = parity_note(&even(), serialport::Parity::None, false)
            .unwrap_err()
            .to_string();
        assert!(
            error.contains("parity Even was asked for, the port has None"),
            "{error}"
        );
        assert_eq!(
            parity_note(&even(), serialport::Parity::Even, false).unwrap(),
            None
        );
    }

    #[test]
    fn what_the_system_refuses_is_told_apart() {
        let of = |kind| {
            refused(
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
    fn a_rate_two_percent_off_is_refused_with_both_figures() {
        assert!(check_baud(&even(), 230_400 + 4_608).is_ok());
        let error = check_baud(&even(), 225_000).unwrap_err().to_string();
        assert!(
            error.contains("230400") && error.contains("225000"),
            "{error}"
        );
    }

    #[test]
    fn an_answer_of_one_value_keeps_the_line_busy_for_17_characters_of_11_bits() {
        // 17 x 11 / 230400 s = 811.6 us
        assert_eq!(even().line_time_ns(17), 811_631);
        assert_eq!(PortSettings::new("", 921_600).line_time_ns(3), 32_552);
    }
}
