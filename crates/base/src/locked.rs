//! An open file with a lock that ends when its holder drops it.
//!
//! The lock is `flock` on the open file: the kernel releases it when the process ends for any reason. But it ends only with the last
//! copy of the descriptor, and a child process that another thread starts has a copy of each one until it executes its program. A lock
//! that ended with its descriptor would sometimes still be held for a moment, so it is released explicitly.

use std::fs::{File, TryLockError};
use std::ops::Deref;

/// An open file or folder, locked until it is dropped.
#[derive(Debug)]
pub struct Locked(File);

/// A file whose lock was refused.
#[derive(Debug)]
pub struct NotLocked {
    /// The file.
    pub file: File,
    /// Why: somebody else holds a lock, or the file system fails.
    pub error: TryLockError,
}

impl Locked {
    /// Locks a file for this holder alone, without waiting.
    ///
    /// # Errors
    /// When somebody else holds a lock, and those of the file system.
    pub fn exclusive(file: File) -> Result<Locked, NotLocked> {
        Locked::after(file.try_lock(), file)
    }

    /// Locks a file for reading, without waiting: other readers may hold it too, a writer may not.
    ///
    /// # Errors
    /// Those of [`Locked::exclusive`].
    pub fn shared(file: File) -> Result<Locked, NotLocked> {
        Locked::after(file.try_lock_shared(), file)
    }

    fn after(locked: Result<(), TryLockError>, file: File) -> Result<Locked, NotLocked> {
        match locked {
            Ok(()) => Ok(Locked(file)),
            Err(error) => Err(NotLocked { file, error }),
        }
    }
}

impl Deref for Locked {
    type Target = File;

    fn deref(&self) -> &File {
        &self.0
    }
}

impl Drop for Locked {
    fn drop(&mut self) {
        let _ = self.0.unlock(); // otherwise it ends with the last copy of the descriptor
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn is_free(path: &Path) -> bool {
        let file = File::open(path).expect("a file");
        match Locked::exclusive(file) {
            Ok(_) => true,
            Err(NotLocked { error, .. }) => {
                assert!(matches!(error, TryLockError::WouldBlock), "{error}");
                false
            }
        }
    }

    #[test]
    fn dropped_lock_is_free_while_a_copy_of_the_descriptor_is_open() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("file");
        for lock in [Locked::exclusive, Locked::shared] {
            let file = File::create(&path).expect("a new file");
            // As a child process has it until it executes its program.
            let copy = file.try_clone().expect("a copy");
            let locked = lock(file).expect("a free lock");
            assert!(!is_free(&path));
            drop(locked);
            assert!(is_free(&path));
            drop(copy);
        }
    }
}
