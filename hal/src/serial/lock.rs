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

use nix::fcntl::{Flock, FlockArg, OFlag};

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
/// may be refused, so the existing file is opened first. Another user may have put a symbolic link or a pipe there: neither is opened.
fn open(path: &Path) -> std::io::Result<File> {
    let mut options = OpenOptions::new();
    let flags = OFlag::O_NOFOLLOW | OFlag::O_NONBLOCK;
    options.read(true).write(true).custom_flags(flags.bits());
    let existing = options.open(path);
    let file = existing.or_else(|_| options.create(true).truncate(false).mode(0o666).open(path))?;
    if file.metadata()?.is_file() {
        Ok(file)
    } else {
        Err(std::io::Error::other("it is not a regular file"))
    }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn does_not_write_through_a_link_of_another_user() {
        let folder = tempfile::tempdir().expect("a folder");
        let (device, target) = (Path::new("/dev/ttyX"), folder.path().join("target"));
        std::fs::write(&target, "content").expect("a file");
        let name = folder.path().join(name_of(device));
        std::os::unix::fs::symlink(&target, name).expect("a link");
        let refused = PortLock::take(folder.path(), device, device);
        assert!(matches!(refused, Err(SerialError::Lock { .. })));
        assert_eq!(std::fs::read_to_string(&target).expect("a file"), "content");
    }

    #[test]
    fn second_lock_names_the_process_of_the_first() {
        let folder = tempfile::tempdir().expect("a folder");
        let device = Path::new("/dev/ttyX");
        let first = PortLock::take(folder.path(), device, device).expect("a free port");
        let second = PortLock::take(folder.path(), device, device);
        let me = std::process::id();
        assert!(matches!(second, Err(SerialError::PortInUse { pid: Some(pid), .. }) if pid == me));
        drop(first);
        PortLock::take(folder.path(), device, device).expect("a free port");
    }
}
