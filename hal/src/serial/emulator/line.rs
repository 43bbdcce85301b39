//! The probe's end of a serial line: a port, or the master of a pseudo terminal with the speed of the emulated line.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use serialport::{ClearBuffer, SerialPort, TTYPort};

use crate::serial::error::SerialError;
use crate::serial::ioctl;
use crate::serial::note::Note;
use crate::serial::port::{Port, PortSettings, is_no_data};

/// If more bytes than this are waiting in the terminal, it is not being read.
const UNREAD_MAX: u32 = 2048;
/// How long a write may wait for space.
const WRITE_WAIT: Duration = Duration::from_millis(5);
/// If the line is this far behind, further bytes are lost: the probe sends more than the line can transmit.
const BACKLOG_MAX_NS: u64 = 1_000_000_000;
/// How often the exclusive use of the pseudo terminal is ended.
const RELEASE_PERIOD_NS: u64 = 50_000_000;

/// The line of an emulated probe.
pub struct Line {
    end: End,
    path: PathBuf,
    settings: PortSettings,
    /// Bytes in transmission, with the arrival time of the last of them.
    in_transit: VecDeque<(u64, Vec<u8>)>,
    /// When the line will have transmitted all bytes.
    busy_until_ns: u64,
    next_release_ns: u64,
}

enum End {
    Port(Port),
    /// The slave is kept open, so that the line remains when a reader closes it.
    Terminal {
        master: TTYPort,
        slave: TTYPort,
    },
}

impl Line {
    /// Opens and locks the port of `settings`. The notes name the settings that it did not accept.
    pub fn port(settings: PortSettings) -> Result<(Line, Vec<Note>), SerialError> {
        let (port, notes) = Port::open(&settings)?;
        let line = Line::new(End::Port(port), settings.path.clone(), settings);
        Ok((line, notes))
    }

    /// Creates a pseudo terminal with the speed of the line of `settings`. The reader opens its slave, [`path`](Line::path).
    pub fn terminal(settings: PortSettings) -> Result<Line, SerialError> {
        let open_error = |source| SerialError::Open {
            path: "/dev/ptmx".into(),
            source,
        };
        let (master, slave) = TTYPort::pair().map_err(open_error)?;
        ioctl::do_not_block(&master).map_err(|source| open_error(source.into()))?;
        let path = slave.name().unwrap_or_default().into();
        Ok(Line::new(End::Terminal { master, slave }, path, settings))
    }

    fn new(end: End, path: PathBuf, settings: PortSettings) -> Line {
        Line {
            end,
            path,
            settings,
            in_transit: VecDeque::new(),
            busy_until_ns: 0,
            next_release_ns: 0,
        }
    }

    /// Path of the port, or of the slave of the pseudo terminal.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Reads bytes of the host that arrive within `wait`; 0 if there are none. An error means that the line is lost.
    pub(super) fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        match &mut self.end {
            End::Port(port) => port.read(buffer, wait),
            End::Terminal { master, .. } => {
                master.set_timeout(wait).map_err(io::Error::from)?;
                match master.read(buffer) {
                    Err(error) if is_no_data(&error) => Ok(0),
                    other => other,
                }
            }
        }
    }

    /// Starts the transmission of `bytes` after a request of `request` bytes, which takes its time on the line, too.
    pub(super) fn transmit(&mut self, bytes: Vec<u8>, request: usize, now_ns: u64) {
        if bytes.is_empty() || self.busy_until_ns > now_ns + BACKLOG_MAX_NS {
            return;
        }
        let line_ns = match self.end {
            End::Port(_) => 0, // the port itself has the speed of the line
            End::Terminal { .. } => self.settings.line_time_ns((request + bytes.len()) as u32),
        };
        self.busy_until_ns = self.busy_until_ns.max(now_ns) + line_ns;
        self.in_transit.push_back((self.busy_until_ns, bytes));
    }

    /// When the next bytes arrive.
    pub(super) fn due_ns(&self) -> Option<u64> {
        self.in_transit.front().map(|(due_ns, _)| *due_ns)
    }

    /// Delivers the bytes that have arrived by `now_ns`; returns their number.
    pub(super) fn deliver(&mut self, now_ns: u64) -> io::Result<u64> {
        self.release_terminal(now_ns);
        let mut count = 0;
        while let Some((_, bytes)) = self
            .in_transit
            .pop_front_if(|(due_ns, _)| *due_ns <= now_ns)
        {
            self.write(&bytes)?;
            count += bytes.len() as u64;
        }
        Ok(count)
    }

    /// Writes `bytes` to the line. On a pseudo terminal all unread bytes are discarded if more than [`UNREAD_MAX`] of
    /// them wait; bytes that do not fit within [`WRITE_WAIT`] are lost.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let written = match &mut self.end {
            End::Port(port) => port.write(bytes, WRITE_WAIT),
            End::Terminal { master, slave } => {
                if slave.bytes_to_read().unwrap_or(0) > UNREAD_MAX {
                    slave.clear(ClearBuffer::Input).map_err(io::Error::from)?;
                }
                master.set_timeout(WRITE_WAIT).map_err(io::Error::from)?;
                master.write_all(bytes)
            }
        };
        match written {
            Err(error) if is_no_data(&error) => Ok(()),
            other => other,
        }
    }

    /// Ends the exclusive use of the slave that a killed reader leaves behind. On a port it ends with the last close, but
    /// here the slave stays open, and only root could open it again. Readers exclude each other by their lock files.
    fn release_terminal(&mut self, now_ns: u64) {
        let End::Terminal { slave, .. } = &self.end else {
            return;
        };
        if now_ns >= self.next_release_ns {
            self.next_release_ns = now_ns + RELEASE_PERIOD_NS;
            ioctl::end_exclusive_use(slave);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Transmits bytes on an idle line and delivers them when all have passed it.
    fn deliver(line: &mut Line, bytes: Vec<u8>) -> io::Result<u64> {
        let now_ns = line.busy_until_ns;
        line.transmit(bytes, 0, now_ns);
        line.deliver(line.busy_until_ns)
    }

    /// More than the terminal can hold: 4 KiB of its line discipline and 64 KiB of its buffers.
    const MORE_THAN_FITS: usize = 200_000;

    #[test]
    fn bytes_beyond_the_space_of_an_unread_terminal_are_lost_without_blocking() {
        let mut line = Line::terminal(PortSettings::new("", 921_600)).unwrap();
        for _ in 0..3 {
            deliver(&mut line, vec![b'x'; MORE_THAN_FITS]).unwrap();
        }
    }

    #[test]
    fn a_reader_of_a_terminal_that_was_full_receives_new_bytes() {
        let mut line = Line::terminal(PortSettings::new("", 921_600)).unwrap();
        deliver(&mut line, vec![b'x'; MORE_THAN_FITS]).unwrap();
        let locks = tempfile::tempdir().unwrap();
        let port = PortSettings {
            lock_dir: locks.path().into(),
            ..PortSettings::new(line.path(), 921_600)
        };
        let (mut port, _) = Port::open(&port).unwrap();
        let mut buffer = [0; 4096];
        // Each round either receives old bytes or delivers a new one; 200 kB take about 50 rounds.
        for _ in 0..1000 {
            let count = port.read(&mut buffer, Duration::from_millis(10)).unwrap();
            if buffer[..count].contains(&b'n') {
                return;
            }
            deliver(&mut line, vec![b'n']).unwrap();
        }
        panic!("no new byte was received");
    }
}
