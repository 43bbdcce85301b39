//! Lock files: one process owns a thing, and others learn which one. The [lock](super::locked) is on the open file, so that the kernel
//! releases it when the process ends for any reason. Processes that it starts do not inherit the file (O_CLOEXEC).

use std::fmt;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use serde::{Deserialize, Serialize};

use super::atomic_file::sync_folder;
use super::locked::{Locked, NotLocked};
use super::timestamp;

/// Attempts to open a file that other processes create and remove at the same time.
const ATTEMPTS: usize = 20;
/// Longest text of a holder that is read.
const MAX_TEXT_BYTES: u64 = 4096;

/// The process that holds a lock, as it states in the file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Holder {
    /// Number of the process.
    pub pid: u32,
    /// What it does, for example `the daemon at /run/bench/bench.sock`.
    pub purpose: String,
    /// When it took the lock, in UTC.
    pub since: String,
}

impl Holder {
    /// This process.
    pub fn this_process(purpose: impl Into<String>) -> Holder {
        Holder {
            pid: std::process::id(),
            purpose: purpose.into(),
            since: timestamp::seconds(SystemTime::now()),
        }
    }
}

impl fmt::Display for Holder {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Holder {
            pid,
            purpose,
            since,
        } = self;
        write!(formatter, "{purpose} (process {pid}, since {since})")
    }
}

/// A lock that cannot be taken.
#[derive(Debug, thiserror::Error)]
pub enum LockError {
    /// Another process holds it; `None` if that process has not stated its name yet.
    #[error("{}", holder_text(.0.as_ref()))]
    Held(Option<Holder>),
    /// The file cannot be opened, locked or written.
    #[error(transparent)]
    Io(#[from] io::Error),
}

fn holder_text(holder: Option<&Holder>) -> String {
    holder.map_or_else(|| "another process".into(), Holder::to_string)
}

/// A lock of this process. Dropping it removes the file.
#[derive(Debug)]
pub struct LockFile {
    path: PathBuf,
    file: Locked,
    was_left: bool,
    is_kept: bool,
}

impl LockFile {
    /// Locks `path` without waiting and writes `holder` to it. A symbolic link is refused.
    ///
    /// # Errors
    /// When another process holds the lock, and those of the file system.
    pub fn take(path: &Path, holder: &Holder) -> Result<LockFile, LockError> {
        for _ in 0..ATTEMPTS {
            let (file, was_left) = open(path)?;
            let file = lock(file)?;
            // The process before may have removed the file after it was opened here: then the lock is on no file of this name.
            if is_file_at(path, &file) {
                write(&file, path, holder)?;
                return Ok(LockFile {
                    path: path.into(),
                    file,
                    was_left,
                    is_kept: false,
                });
            }
        }
        Err(LockError::Held(None))
    }

    /// Whether a process that held the lock ended without removing the file.
    pub fn was_left(&self) -> bool {
        self.was_left
    }

    /// Whether the file remains when the lock is dropped, as after a crash.
    pub fn keep(&mut self, is_kept: bool) {
        self.is_kept = is_kept;
    }
}

impl Drop for LockFile {
    fn drop(&mut self) {
        if !self.is_kept && is_file_at(&self.path, &self.file) {
            let _ = std::fs::remove_file(&self.path); // the lock ends anyway
        }
    }
}

/// The file, and whether it existed.
fn open(path: &Path) -> Result<(File, bool), LockError> {
    let flags = libc::O_NOFOLLOW | libc::O_NONBLOCK;
    let mut options = OpenOptions::new();
    options.read(true).write(true).custom_flags(flags);
    for _ in 0..ATTEMPTS {
        match options.clone().create_new(true).open(path) {
            Ok(file) => return Ok((file, false)),
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error.into()),
        }
        match options.open(path) {
            Err(error) if error.kind() == ErrorKind::NotFound => {} // removed in between
            Err(error) if error.kind() == ErrorKind::PermissionDenied => {
                return Err(of_another_user(path, error));
            }
            Err(error) => return Err(error.into()),
            Ok(file) if file.metadata()?.is_file() => return Ok((file, true)),
            Ok(_) => return Err(io::Error::other("it is not a regular file").into()),
        }
    }
    Err(LockError::Held(None))
}

/// A lock file that this user may only read: its holder, if it is locked.
fn of_another_user(path: &Path, denied: io::Error) -> LockError {
    let mut options = OpenOptions::new();
    options.read(true);
    let opened = options
        .custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK)
        .open(path);
    let locked = opened.map_err(LockError::Io).and_then(lock);
    match locked {
        Err(held @ LockError::Held(_)) => held,
        Err(LockError::Io(_)) | Ok(_) => denied.into(),
    }
}

fn lock(file: File) -> Result<Locked, LockError> {
    Locked::exclusive(file).map_err(|NotLocked { file, error }| match error {
        TryLockError::WouldBlock => LockError::Held(read(&file)),
        TryLockError::Error(error) => error.into(),
    })
}

fn read(file: &File) -> Option<Holder> {
    let mut text = String::new();
    file.take(MAX_TEXT_BYTES).read_to_string(&mut text).ok()?;
    serde_json::from_str(&text).ok()
}

/// Writes the holder and brings it to the disk: after a power failure the file is present.
fn write(mut file: &File, path: &Path, holder: &Holder) -> io::Result<()> {
    let text = serde_json::to_string(holder).map_err(io::Error::other)?;
    file.set_len(0)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()?;
    sync_folder(path)
}

/// Whether the file at `path` is the open `file`; the target of a symbolic link does not count.
pub fn is_file_at(path: &Path, file: &File) -> bool {
    let (Ok(named), Ok(open)) = (std::fs::symlink_metadata(path), file.metadata()) else {
        return false;
    };
    (named.dev(), named.ino()) == (open.dev(), open.ino())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn held(path: &Path) -> Option<Holder> {
        match LockFile::take(path, &Holder::this_process("the second")) {
            Err(LockError::Held(holder)) => holder,
            other => panic!("{other:?}"),
        }
    }

    #[test]
    fn second_lock_is_refused_with_the_holder_until_the_first_is_dropped() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("lock");
        let first = Holder::this_process("the first");
        let lock = LockFile::take(&path, &first).expect("a free lock");
        assert!(!lock.was_left());
        assert_eq!(held(&path), Some(first));
        drop(lock);
        assert!(!path.exists());
        LockFile::take(&path, &Holder::this_process("the next")).expect("a free lock");
    }

    #[test]
    fn file_without_its_process_is_left_by_a_crash() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("lock");
        let mut lock = LockFile::take(&path, &Holder::this_process("a")).expect("a free lock");
        lock.keep(true);
        drop(lock);
        let next = LockFile::take(&path, &Holder::this_process("b")).expect("a free lock");
        assert!(next.was_left());
    }

    #[test]
    fn removes_only_its_own_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("lock");
        let first = LockFile::take(&path, &Holder::this_process("a")).expect("a free lock");
        std::fs::remove_file(&path).expect("the file");
        let second = LockFile::take(&path, &Holder::this_process("b")).expect("a new file");
        drop(first);
        assert!(path.exists());
        drop(second);
        assert!(!path.exists());
    }

    #[test]
    fn refuses_a_symbolic_link_and_leaves_its_target() {
        let folder = tempfile::tempdir().expect("a folder");
        let (path, target) = (folder.path().join("lock"), folder.path().join("target"));
        std::fs::write(&target, "content").expect("a file");
        std::os::unix::fs::symlink(&target, &path).expect("a link");
        let taken = LockFile::take(&path, &Holder::this_process("a"));
        assert!(matches!(taken, Err(LockError::Io(_))), "{taken:?}");
        assert_eq!(std::fs::read_to_string(&target).expect("a file"), "content");
    }

    #[test]
    fn only_one_of_many_threads_holds_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("lock");
        let holders = std::sync::atomic::AtomicUsize::new(0);
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| take_and_count(&path, &holders));
            }
        });
    }

    fn take_and_count(path: &Path, holders: &std::sync::atomic::AtomicUsize) {
        use std::sync::atomic::Ordering::SeqCst;
        for _ in 0..200 {
            let Ok(lock) = LockFile::take(path, &Holder::this_process("a thread")) else {
                continue;
            };
            assert_eq!(holders.fetch_add(1, SeqCst), 0, "two holders");
            holders.fetch_sub(1, SeqCst);
            drop(lock);
        }
    }
}
