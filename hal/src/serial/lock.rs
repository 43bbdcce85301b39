//! One process a port.
//!
//! The library's own lock (TIOCEXCL and flock on the terminal) keeps others out but cannot name the holder, and TIOCEXCL
//! does not hold against root. So before the port is opened a lock file named after the *resolved* device (two links to
//! one port are one port) is locked by flock and given our process id. The kernel drops the lock with the process, however
//! it ends; the file stays, and means nothing without the lock.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

use nix::fcntl::{Flock, FlockArg};

use super::error::SerialError;

/// Holds the port for this process until dropped.
#[derive(Debug)]
pub(super) struct PortLock {
    _held: Flock<File>,
}

impl PortLock {
    /// Takes the lock of `device` (a resolved path, `port` as configured), or names the process that has it.
    pub(super) fn take(lock_dir: &Path, port: &Path, device: &Path) -> Result<Self, SerialError> {
        let path = lock_dir.join(name_of(device));
        let file = open(&path).map_err(|source| SerialError::Lock {
            path: path.clone(),
            source,
        })?;
        match Flock::lock(file, FlockArg::LockExclusiveNonblock) {
            Ok(mut held) => {
                sign(&mut held).map_err(|source| SerialError::Lock { path, source })?;
                Ok(Self { _held: held })
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

/// Opens the file for every user of the port: in a shared, sticky directory only its maker may create it.
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

fn sign(file: &mut File) -> std::io::Result<()> {
    file.set_len(0)?;
    file.rewind()?;
    writeln!(file, "{}", std::process::id())
}

fn read_pid(file: &mut File) -> Option<u32> {
    let mut text = String::new();
    file.take(16).read_to_string(&mut text).ok()?;
    text.trim().parse().ok()
}
