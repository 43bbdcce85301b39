//! A name for a pseudo terminal, as long as the terminal is served.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::EmulatorError;

/// A symbolic link, removed when dropped.
#[derive(Debug)]
pub(super) struct Link {
    path: PathBuf,
    target: PathBuf,
}

impl Link {
    /// Links `path` to `target`. Only a dangling link, left by a process that was killed, is replaced.
    pub(super) fn new(path: &Path, target: &Path) -> Result<Link, EmulatorError> {
        if path.is_symlink() && !path.exists() {
            let _ = std::fs::remove_file(path); // a failure is reported by the next call
        }
        std::os::unix::fs::symlink(target, path).map_err(|error| EmulatorError::Link {
            path: path.into(),
            why: match error.kind() {
                ErrorKind::AlreadyExists => "it exists".to_string(),
                _ => error.to_string(),
            },
        })?;
        let (path, target) = (path.into(), target.into());
        Ok(Link { path, target })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_replaces_only_a_dangling_link_and_is_removed_when_dropped() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (path, target) = (folder.path().join("probe"), folder.path().join("terminal"));
        std::os::unix::fs::symlink("/nowhere", &path).expect("a link");
        std::fs::write(&target, "").expect("a file");
        let link = Link::new(&path, &target).expect("a dangling link is replaced");
        let error = Link::new(&path, &target).expect_err("the link is in use");
        let error = error.to_string();
        assert!(
            error.contains("it exists") && error.contains("--pty"),
            "{error}"
        );
        drop(link);
        assert!(!path.is_symlink() && target.exists());
    }
}
