//! New files, which never overwrite others.

use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};

/// `STEM_what.ext` beside `path` with its stem, or with -2, -3, ... if that name is taken.
pub fn free_path(path: &Path, what: &str, extension: &str) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let first = path.with_file_name(format!("{stem}_{what}.{extension}"));
    let numbered = |n: u32| path.with_file_name(format!("{stem}_{what}-{n}.{extension}"));
    let candidates = std::iter::once(first.clone()).chain((2..).map(numbered));
    candidates
        .into_iter()
        .find(|path| !path.exists())
        .unwrap_or(first)
}

/// Writes a file that must not exist yet.
///
/// # Errors
/// When the file exists, or cannot be written.
pub fn write_new(path: &Path, text: &str) -> std::io::Result<()> {
    File::create_new(path)?.write_all(text.as_bytes())
}
