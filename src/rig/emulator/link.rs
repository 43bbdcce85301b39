//! A name for the slave of a pseudo terminal, as long as it is served.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::EmulatorError;

/// A symbolic link; dropping it removes it.
#[derive(Debug)]
pub(super) struct Link {
    path: PathBuf,
    target: PathBuf,
}

impl Link {
    /// Links `path` to `target`. A link that leads nowhere (of a process that was killed) is replaced, nothing else is.
    pub(super) fn new(path: &Path, target: &Path) -> Result<Link, EmulatorError> {
        if path.is_symlink() && !path.exists() {
            let _ = std::fs::remove_file(path); // if it cannot go, the next call says why
        }
        std::os::unix::fs::symlink(target, path).map_err(|error| {
            let why = match error.kind() {
                ErrorKind::AlreadyExists => "it exists".to_string(),
                _ => error.to_string(),
            };
            EmulatorError::Link {
                path: path.into(),
                why,
            }
        })?;
        Ok(Link {
            path: path.into(),
            target: target.into(),
        })
    }

    /// The link's own name.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

impl Drop for Link {
    fn drop(&mut self) {
        if std::fs::read_link(&self.path).is_ok_and(|target| target == self.target) {
            let _ = std::fs::remove_file(&self.path); // whoever took it away meanwhile has done it
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_replaces_one_that_leads_nowhere_and_nothing_else_and_goes_when_dropped() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (path, target) = (folder.path().join("probe"), folder.path().join("terminal"));
        std::os::unix::fs::symlink("/nowhere", &path).expect("a link");
        std::fs::write(&target, "").expect("a file");
        let link = Link::new(&path, &target).expect("a dead link is replaced");
        let error = Link::new(&path, &target)
            .expect_err("it is in use")
            .to_string();
        assert!(
            error.contains("it exists") && error.contains("--pty"),
            "{error}"
        );
        drop(link);
        assert!(!path.is_symlink() && target.exists());
    }
}
