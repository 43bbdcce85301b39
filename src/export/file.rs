//! New files that are complete or absent, written as a stream.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::ExportError;
use crate::util::atomic_file::create_free;
use crate::util::input_file::special_kind;

/// The file that is being written.
pub(super) type Output = BufWriter<File>;

/// Where a file is written. Nothing that exists is replaced.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// This file, which must not exist.
    Named(PathBuf),
    /// This file or, if the name is taken, `STEM-2.EXT`, `STEM-3.EXT`, ...
    Numbered(PathBuf),
}

impl Target {
    /// Refuses a file that exists, before anything is computed.
    ///
    /// # Errors
    /// [`ExportError::Exists`] and [`ExportError::Special`].
    pub fn check(&self) -> Result<(), ExportError> {
        let Target::Named(path) = self else {
            return Ok(());
        };
        if let Some(kind) = special_kind(path) {
            let path = path.clone();
            return Err(ExportError::Special { path, kind });
        }
        // A symbolic link to nothing exists, too.
        match path.symlink_metadata().is_ok() {
            true => Err(ExportError::Exists { path: path.clone() }),
            false => Ok(()),
        }
    }

    fn path(&self) -> &Path {
        match self {
            Target::Named(path) | Target::Numbered(path) => path,
        }
    }

    /// Creates the file, empty.
    fn claim(&self) -> Result<PathBuf, ExportError> {
        match self {
            Target::Numbered(path) => Ok(create_free(path)?),
            Target::Named(path) => match File::create_new(path) {
                Ok(_) => Ok(path.clone()),
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {
                    Err(ExportError::Exists { path: path.clone() })
                }
                Err(error) => Err(error.into()),
            },
        }
    }
}

/// Writes a new file under another name and renames it when it is complete. Returns its path and the result of `write`.
pub(super) fn write_new<T>(
    target: &Target,
    write: impl FnOnce(&mut Output) -> Result<T, ExportError>,
) -> Result<(PathBuf, T), ExportError> {
    target.check()?;
    let partial = PathBuf::from(format!("{}.partial", target.path().display()));
    let written =
        write_synced(&partial, write).and_then(|result| Ok((rename_to(&partial, target)?, result)));
    written.map_err(|error| {
        // The error of writing is the one to report.
        let _ = std::fs::remove_file(&partial);
        error.at(target.path())
    })
}

fn write_synced<T>(
    partial: &Path,
    write: impl FnOnce(&mut Output) -> Result<T, ExportError>,
) -> Result<T, ExportError> {
    let mut out = BufWriter::new(create_partial(partial)?);
    let result = write(&mut out)?;
    out.flush()?;
    out.get_ref().sync_all()?;
    Ok(result)
}

/// Creates the partial file in place of one that a killed process left.
fn create_partial(partial: &Path) -> std::io::Result<File> {
    if partial.is_file() {
        std::fs::remove_file(partial)?;
    }
    File::create_new(partial)
}

fn rename_to(partial: &Path, target: &Target) -> Result<PathBuf, ExportError> {
    let path = target.claim()?;
    if let Err(error) = std::fs::rename(partial, &path) {
        let _ = std::fs::remove_file(&path);
        return Err(error.into());
    }
    Ok(path)
}
