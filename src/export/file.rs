//! Files that are complete or absent, written as a stream.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::ExportError;

/// The file that is being written.
pub(super) type Output = BufWriter<File>;

/// Writes a file under another name and renames it when it is complete.
pub(super) fn replace(
    path: &Path,
    write: impl FnOnce(&mut Output) -> Result<(), ExportError>,
) -> Result<(), ExportError> {
    let partial = PathBuf::from(format!("{}.partial", path.display()));
    let written = write_synced(&partial, write)
        .and_then(|()| std::fs::rename(&partial, path).map_err(ExportError::from));
    written.map_err(|error| {
        // The error of writing is the one to report.
        let _ = std::fs::remove_file(&partial);
        named(error, path)
    })
}

fn write_synced(
    partial: &Path,
    write: impl FnOnce(&mut Output) -> Result<(), ExportError>,
) -> Result<(), ExportError> {
    let mut out = BufWriter::new(File::create(partial)?);
    write(&mut out)?;
    out.flush()?;
    out.get_ref().sync_all()?;
    Ok(())
}

/// The error with the name of the file.
fn named(error: ExportError, path: &Path) -> ExportError {
    match error {
        ExportError::Write { source, .. } => ExportError::Write {
            path: path.to_owned(),
            source,
        },
        other => other,
    }
}
