//! Names of recordings: when and what. A file that exists is never overwritten.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// `2026-11-21T16-21-09Z_chirp.mcap` in `folder`, with `-2`, `-3`, ... where that is taken.
pub(super) fn recording(folder: &Path, what: &str, now: SystemTime) -> PathBuf {
    let stem = format!(
        "{}_{what}",
        humantime::format_rfc3339_seconds(now)
            .to_string()
            .replace(':', "-")
    );
    let numbered = |n: u32| {
        if n == 1 {
            stem.clone()
        } else {
            format!("{stem}-{n}")
        }
    };
    let free = (1..)
        .map(|n| folder.join(numbered(n) + ".mcap"))
        .find(|path| !path.exists());
    free.unwrap_or_else(|| folder.join(stem + ".mcap"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_is_taken_gets_a_number() {
        let folder = tempfile::tempdir().unwrap();
        let at = SystemTime::UNIX_EPOCH;
        let first = recording(folder.path(), "chirp", at);
        assert_eq!(
            first.file_name().unwrap(),
            "1970-01-01T00-00-00Z_chirp.mcap"
        );
        std::fs::write(&first, "").unwrap();
        assert_eq!(
            recording(folder.path(), "chirp", at).file_name().unwrap(),
            "1970-01-01T00-00-00Z_chirp-2.mcap"
        );
    }
}
