//! Files that are complete or absent.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Writes a file under another name, brings it to the disk and renames it. After a crash the file is the old or the new one,
/// complete.
///
/// # Errors
/// Those of the file system.
pub fn write_atomic(path: &Path, text: &str) -> std::io::Result<()> {
    let partial = PathBuf::from(format!("{}.partial", path.display()));
    let mut file = File::create(&partial)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()?;
    std::fs::rename(&partial, path)?;
    sync_folder(path)
}

/// Brings the name of a file in its folder to the disk.
fn sync_folder(path: &Path) -> std::io::Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    File::open(folder)?.sync_all()
}
