//! The probe's end of a serial line: a port, or the master of a pseudo terminal as slow as the line it stands for.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};
use std::time::Duration;

use serialport::{ClearBuffer, SerialPort, TTYPort};

use crate::serial::error::SerialError;
use crate::serial::port::{Note, Port, PortSettings, is_nothing};

/// More bytes than this wait for a reader: nobody reads.
const UNREAD: u32 = 2048;
/// How long a write may wait for room.
const WRITE_WAIT: Duration = Duration::from_millis(5);
/// A line that is so far behind takes no more: a probe that says more than the line carries loses the rest.
const FULL_NS: u64 = 1_000_000_000;
/// How often the slave of a pseudo terminal is freed of the mark of a reader that was killed.
const FREE_NS: u64 = 50_000_000;

/// Where a pretend probe is connected.
pub struct Line {
    end: End,
    path: PathBuf,
    settings: PortSettings,
    /// What is on its way, with the time at which its last bit arrives.
    sending: VecDeque<(u64, Vec<u8>)>,
    /// Until when the line carries what was given to it.
    busy_ns: u64,
    freed_ns: u64,
}

enum End {
    Port(Port),
    /// The slave stays open here, so that the line outlives whoever reads it.
    Terminal {
        master: TTYPort,
        slave: TTYPort,
    },
}

impl Line {
    /// Opens the port of `settings` and takes it for this process; with what it did not take.
    pub fn port(settings: PortSettings) -> Result<(Line, Vec<Note>), SerialError> {
        let (port, notes) = Port::open(&settings)?;
        Ok((
            Line::new(End::Port(port), settings.path.clone(), settings),
            notes,
        ))
    }

    /// Makes a pseudo terminal that carries bytes as fast as the line of `settings`; its slave is for the reader.
    pub fn terminal(settings: PortSettings) -> Result<Line, SerialError> {
        let made = TTYPort::pair();
        let (master, slave) = made.map_err(|source| SerialError::Open {
            path: "/dev/ptmx".into(),
            source,
        })?;
        let path = slave.name().unwrap_or_default().into();
        Ok(Line::new(End::Terminal { master, slave }, path, settings))
    }

    fn new(end: End, path: PathBuf, settings: PortSettings) -> Line {
        Line {
            end,
            path,
            settings,
            sending: VecDeque::new(),
            busy_ns: 0,
            freed_ns: 0,
        }
    }

    /// The port, or the slave of the pseudo terminal.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Bytes from the host, waiting up to `wait` for them; 0 if there are none. An error: the line is lost.
    pub(super) fn read(&mut self, buffer: &mut [u8], wait: Duration) -> io::Result<usize> {
        match &mut self.end {
            End::Port(port) => port.read(buffer, wait),
            End::Terminal { master, .. } => {
                master.set_timeout(wait).map_err(io::Error::from)?;
                master.read(buffer).or_else(|error| {
                    if is_nothing(&error) {
                        Ok(0)
                    } else {
                        Err(error)
                    }
                })
            }
        }
    }

    /// Gives `bytes` to the line, after `asked` bytes of the host that took their time, too.
    pub(super) fn give(&mut self, bytes: Vec<u8>, asked: usize, now_ns: u64) {
        if bytes.is_empty() || self.busy_ns > now_ns + FULL_NS {
            return;
        }
        let is_port = matches!(self.end, End::Port(_));
        let line_ns = if is_port {
            0
        } else {
            self.settings.line_time_ns((asked + bytes.len()) as u32)
        };
        self.busy_ns = self.busy_ns.max(now_ns) + line_ns;
        self.sending.push_back((self.busy_ns, bytes));
    }

    /// When the next bytes arrive.
    pub(super) fn due_ns(&self) -> Option<u64> {
        self.sending.front().map(|(due_ns, _)| *due_ns)
    }

    /// Hands over what has arrived by `now_ns`; returns how many bytes.
    pub(super) fn deliver(&mut self, now_ns: u64) -> io::Result<u64> {
        self.free_slave(now_ns);
        let mut count = 0;
        while let Some((_, bytes)) = self.sending.pop_front_if(|(due_ns, _)| *due_ns <= now_ns) {
            self.write(&bytes)?;
            count += bytes.len() as u64;
        }
        Ok(count)
    }

    /// What nobody reads is lost, as on a wire without a reader.
    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        let written = match &mut self.end {
            End::Port(port) => port.write(bytes, WRITE_WAIT),
            End::Terminal { master, slave } => {
                if slave.bytes_to_read().unwrap_or(0) > UNREAD {
                    slave.clear(ClearBuffer::Input).map_err(io::Error::from)?;
                }
                master.set_timeout(WRITE_WAIT).map_err(io::Error::from)?;
                master.write_all(bytes)
            }
        };
        written.or_else(|error| {
            if is_nothing(&error) {
                Ok(())
            } else {
                Err(error)
            }
        })
    }

    /// Takes off the mark of exclusive use that a reader leaves on the slave when it is killed: on a port it goes with the
    /// last closing, but here the slave stays open, and the next reader would be refused. Readers keep each other out by
    /// their locks.
    fn free_slave(&mut self, now_ns: u64) {
        let End::Terminal { slave, .. } = &self.end else {
            return;
        };
        if now_ns < self.freed_ns {
            return;
        }
        self.freed_ns = now_ns + FREE_NS;
        // SAFETY: the descriptor is open as long as `slave` lives; TIOCNXCL takes no argument.
        let _ = unsafe { libc::ioctl(slave.as_raw_fd(), libc::TIOCNXCL) }; // else only root can open it next
    }
}
