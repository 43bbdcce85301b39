//! Files that are complete or absent.

use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Writes a file under another name, brings its content to the disk and renames it. After a crash the file is the old or the
/// new one, complete.
///
/// # Errors
/// Those of the file system.
pub fn write_atomic(path: &Path, text: &str) -> std::io::Result<()> {
    let partial = PathBuf::from(format!("{}.partial", path.display()));
    let written = write_synced(&partial, text).and_then(|()| std::fs::rename(&partial, path));
    if written.is_err() {
        // The error of writing is the one to report.
        let _ = std::fs::remove_file(&partial);
    }
    written
}

fn write_synced(path: &Path, text: &str) -> std::io::Result<()> {
    let mut file = File::create(path)?;
    file.write_all(text.as_bytes())?;
    file.sync_all()
}

/// As [`write_atomic`], and brings the name in its folder to the disk: after a power failure the file is present.
///
/// # Errors
/// Those of the file system.
pub fn write_durable(path: &Path, text: &str) -> std::io::Result<()> {
    write_atomic(path, text)?;
    sync_folder(path)
}

/// Brings the name of a file in its folder to the disk, where the file system supports that for a folder.
pub(super) fn sync_folder(path: &Path) -> std::io::Result<()> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let Err(error) = File::open(folder)?.sync_all() else {
        return Ok(());
    };
    match error.raw_os_error() {
        Some(libc::EINVAL | libc::ENOTSUP) => Ok(()),
        _ => Err(error),
    }
}

/// As [`write_atomic`], but overwrites no file: if the name is taken, the file is `STEM-2.EXT`, `STEM-3.EXT`, ... Returns its
/// path. An empty file holds the name until the content is complete.
///
/// # Errors
/// Those of the file system. The incomplete file is removed.
pub fn write_new(path: &Path, text: &str) -> std::io::Result<PathBuf> {
    let path = create_free(path)?;
    if let Err(error) = write_atomic(&path, text) {
        // The error of writing is the one to report.
        let _ = std::fs::remove_file(&path);
        return Err(error);
    }
    Ok(path)
}

/// Creates an empty file under the first free name: `STEM.EXT`, `STEM-2.EXT`, ...
///
/// # Errors
/// Those of the file system.
pub fn create_free(path: &Path) -> std::io::Result<PathBuf> {
    for name in numbered_names(path) {
        match File::create_new(&name) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            created => return created.map(|_| name),
        }
    }
    Err(ErrorKind::AlreadyExists.into())
}

/// The name, then `STEM-2.EXT`, `STEM-3.EXT`, ...
pub fn numbered_names(path: &Path) -> impl Iterator<Item = PathBuf> {
    let numbers = 2..=u32::MAX;
    std::iter::once(path.to_owned()).chain(numbers.map(|number| numbered(path, number)))
}

/// `STEM-NUMBER.EXT`.
fn numbered(path: &Path, number: u32) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let name = format!("{stem}-{number}");
    match path.extension() {
        Some(extension) => path.with_file_name(format!("{name}.{}", extension.to_string_lossy())),
        None => path.with_file_name(name),
    }
}
