//! A name for a pseudo terminal, as long as the terminal is served.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::EmulatorError;
use bench_base::lock_file::{Holder, LockError, LockFile};

/// Folder of the pseudo terminals.
const TERMINALS: &str = "/dev/pts";

/// A symbolic link, removed when dropped. A lock file beside it (`LINK.lock`) shows that it is served.
#[derive(Debug)]
pub(super) struct Link {
    path: PathBuf,
    target: PathBuf,
    /// Dropped after the link was removed.
    _lock: LockFile,
}

impl Link {
    /// Links `path` to `target`. Only a link that a killed process has left is replaced: one that leads to nothing, or one whose lock file
    /// is left and whose terminal has a number that belongs to another terminal by now.
    pub(super) fn new(path: &Path, target: &Path) -> Result<Link, EmulatorError> {
        let lock = lock(path)?;
        if is_left(path, lock.was_left()) {
            let _ = std::fs::remove_file(path); // a failure is reported by the next call
        }
        std::os::unix::fs::symlink(target, path).map_err(|error| {
            let why = match error.kind() {
                ErrorKind::AlreadyExists => "it exists".to_string(),
                _ => error.to_string(),
            };
            refused(path, why)
        })?;
        Ok(Link {
            path: path.into(),
            target: target.into(),
            _lock: lock,
        })
    }

    /// The link's own name.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        let is_ours = std::fs::read_link(&self.path).is_ok_and(|target| target == self.target);
        if is_ours {
            let _ = std::fs::remove_file(&self.path); // it may have been removed already
        }
    }
}

fn lock(path: &Path) -> Result<LockFile, EmulatorError> {
    let file = PathBuf::from(format!("{}.lock", path.display()));
    let taken = LockFile::take(&file, &Holder::this_process("`bench emulate`"));
    taken.map_err(|error| {
        let why = match error {
            LockError::Held(_) => format!("it belongs to {error}, which must end first"),
            LockError::Io(_) => format!("{}: {error}", file.display()),
        };
        refused(path, why)
    })
}

fn is_left(path: &Path, has_lock_file: bool) -> bool {
    let target = std::fs::read_link(path);
    target.is_ok_and(|target| !path.exists() || has_lock_file && target.starts_with(TERMINALS))
}

fn refused(path: &Path, why: String) -> EmulatorError {
    EmulatorError::Link {
        path: path.into(),
        why,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_replaces_only_one_that_was_left_and_is_removed_when_dropped() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (path, target) = (folder.path().join("probe"), folder.path().join("terminal"));
        std::fs::write(&target, "").expect("a file");
        // The second one: the number of the terminal of a killed emulator belongs to another terminal.
        for left in ["/nowhere", "/dev/pts/ptmx"] {
            std::os::unix::fs::symlink(left, &path).expect("a link");
            std::fs::write(folder.path().join("probe.lock"), "").expect("a lock file");
            let link = Link::new(&path, &target).expect("a link that was left is replaced");
            assert_eq!(std::fs::read_link(&path).expect("a link"), target);
            drop(link);
        }
        let link = Link::new(&path, &target).expect("a free name");
        let error = Link::new(&path, &target).expect_err("the link is in use");
        let error = error.to_string();
        let process = format!("process {}", std::process::id());
        assert!(
            error.contains(&process) && error.contains("--pty"),
            "{error}"
        );
        drop(link);
        assert!(!path.is_symlink() && target.exists());
    }

    #[test]
    fn a_link_replaces_nothing_of_the_user() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (path, target) = (folder.path().join("probe"), folder.path().join("terminal"));
        std::fs::write(&target, "").expect("a file");
        // A terminal of another program, and a file.
        for other in [Path::new("/dev/pts/ptmx"), &target] {
            std::os::unix::fs::symlink(other, &path).expect("a link");
            let error = Link::new(&path, &target)
                .expect_err("it exists")
                .to_string();
            assert!(error.contains("it exists"), "{error}");
            std::fs::remove_file(&path).expect("the link");
        }
        std::fs::write(&path, "content").expect("a file");
        assert!(Link::new(&path, &target).is_err());
        assert_eq!(std::fs::read_to_string(&path).expect("a file"), "content");
    }
}
