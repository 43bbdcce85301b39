//! Files that are there as a whole or not at all.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes a file under another name, brings it to the disk and renames it: a stop leaves the old one or the new one.
///
/// # Errors
/// Those of the file system.
pub fn write_whole(path: &Path, text: &str) -> std::io::Result<()> {
    let partial = PathBuf::from(format!("{}.partial", path.display()));
    let mut file = File::create(&partial)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()?;
    std::fs::rename(&partial, path)
}
