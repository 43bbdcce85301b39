//! Names of recordings: time and kind of the run. An existing file is never overwritten.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use bench_base::atomic_file::numbered_names;
use bench_base::timestamp;

/// `2026-11-21T16-21-09Z_chirp.mcap` in `folder`, with `-2`, `-3`, ... where that is taken.
pub(super) fn recording(folder: &Path, what: &str, now: SystemTime) -> PathBuf {
    let time = timestamp::seconds(now);
    let first = folder.join(format!("{}_{what}.mcap", time.replace(':', "-")));
    let free = numbered_names(&first).find(|path| !path.exists());
    free.unwrap_or(first)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_existing_name_gets_a_number() {
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
