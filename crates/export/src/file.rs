//! New files that are complete or absent, written as a stream.

use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::{Path, PathBuf};

use super::ExportError;
use bench_base::atomic_file::create_free;
use bench_base::input_file::special_kind;

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
        if path.symlink_metadata().is_ok() {
            Err(ExportError::Exists { path: path.clone() })
        } else {
            Ok(())
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

/// Writes a new file under another name and renames it when it is complete. Returns its path and the result of `write`. Each call
/// has a partial file of its own, `FILE.partial`, `FILE-2.partial`, ..., also beside one that a killed process left.
pub(super) fn write_new<T>(
    target: &Target,
    write: impl FnOnce(&mut Output) -> Result<T, ExportError>,
) -> Result<(PathBuf, T), ExportError> {
    target.check()?;
    let at_target = |error: ExportError| error.at(target.path());
    let partial = PathBuf::from(format!("{}.partial", target.path().display()));
    let partial = create_free(&partial).map_err(|error| at_target(error.into()))?;
    let written =
        write_synced(&partial, write).and_then(|result| Ok((rename_to(&partial, target)?, result)));
    written.map_err(|error| {
        // The error of writing is the one to report.
        let _ = std::fs::remove_file(&partial);
        at_target(error)
    })
}

fn write_synced<T>(
    partial: &Path,
    write: impl FnOnce(&mut Output) -> Result<T, ExportError>,
) -> Result<T, ExportError> {
    let mut out = BufWriter::new(File::create(partial)?);
    let result = write(&mut out)?;
    out.flush()?;
    out.get_ref().sync_all()?;
    Ok(result)
}

fn rename_to(partial: &Path, target: &Target) -> Result<PathBuf, ExportError> {
    let path = target.claim()?;
    if let Err(error) = std::fs::rename(partial, &path) {
        let _ = std::fs::remove_file(&path);
        return Err(error.into());
    }
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes `text` to a new file, and runs `during` while the file is incomplete.
    fn write(target: &Target, text: &str, during: impl FnOnce()) -> Result<PathBuf, ExportError> {
        let written = write_new(target, |out| {
            during();
            Ok(out.write_all(text.as_bytes())?)
        });
        written.map(|(path, ())| path)
    }

    #[test]
    fn exports_to_one_name_at_the_same_time_have_files_of_their_own() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.csv");
        let target = Target::Numbered(path.clone());
        let mut inner = None;
        let outer = write(&target, "outer", || {
            inner = write(&target, "inner", || {}).ok()
        });
        assert_eq!(inner.as_ref(), Some(&path));
        let outer = outer.expect("written");
        assert_eq!(outer, folder.path().join("run-2.csv"));
        for (file, text) in [(path, "inner"), (outer, "outer")] {
            assert_eq!(std::fs::read_to_string(file).expect("a file"), text);
        }
        assert_eq!(std::fs::read_dir(&folder).expect("a folder").count(), 2);
    }

    #[test]
    fn an_export_to_a_name_that_another_took_meanwhile_is_refused_and_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.csv");
        let target = Target::Named(path.clone());
        let outer = write(&target, "outer", || {
            write(&target, "inner", || {}).expect("a free name");
        });
        assert!(
            matches!(outer, Err(ExportError::Exists { .. })),
            "{outer:?}"
        );
        assert_eq!(std::fs::read_to_string(path).expect("a file"), "inner");
        assert_eq!(std::fs::read_dir(&folder).expect("a folder").count(), 1);
    }
}
