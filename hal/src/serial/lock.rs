//! Locks a port for one process.
//!
//! The lock of the serial-port library (TIOCEXCL and flock on the terminal) excludes other processes but does not identify
//! them, and TIOCEXCL does not apply to root. Therefore a lock file is locked with flock before the port is opened. It
//! has the name of the resolved device, because several links may lead to one port, and contains the process number. The
//! kernel releases the lock when the process ends. The file remains; without the lock it has no meaning.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use nix::fcntl::{Flock, FlockArg};

use super::error::SerialError;

/// Holds the port for this process until dropped.
#[derive(Debug)]
pub(super) struct PortLock {
    _file: Flock<File>,
}

impl PortLock {
    /// Locks `device`, the resolved path of `port`. The error names the process that holds the lock.
    pub(super) fn take(lock_dir: &Path, port: &Path, device: &Path) -> Result<Self, SerialError> {
        let path = lock_dir.join(name_of(device));
        let file = open(&path).map_err(|source| SerialError::Lock {
            path: path.clone(),
            source,
        })?;
        match Flock::lock(file, FlockArg::LockExclusiveNonblock) {
            Ok(mut file) => {
                write_pid(&mut file).map_err(|source| SerialError::Lock { path, source })?;
                Ok(Self { _file: file })
            }
            Err((mut file, _)) => Err(SerialError::PortInUse {
                path: port.to_owned(),
                pid: read_pid(&mut file),
            }),
        }
    }
}

/// `bench-dev-ttyUSB0.lock` for /dev/ttyUSB0.
fn name_of(device: &Path) -> PathBuf {
    let name = device
        .to_string_lossy()
        .trim_start_matches('/')
        .replace('/', "-");
    format!("bench-{name}.lock").into()
}

/// Opens the file, or creates it for every user. In a shared, sticky directory, opening a file of another user with O_CREAT
/// may be refused, so the existing file is opened first.
fn open(path: &Path) -> std::io::Result<File> {
    let existing = OpenOptions::new().read(true).write(true).open(path);
    existing.or_else(|_| {
        OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .mode(0o666)
            .open(path)
    })
}

fn write_pid(file: &mut File) -> std::io::Result<()> {
    file.set_len(0)?;
    file.rewind()?;
    writeln!(file, "{}", std::process::id())
}

fn read_pid(file: &mut File) -> Option<u32> {
    let mut text = String::new();
    file.take(16).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}
