//! The folder for recordings: may it be written, and is there room for a run? Nothing is made in it.

use std::path::{Path, PathBuf};

use nix::sys::statvfs::statvfs;
use nix::unistd::{AccessFlags, eaccess};
use serde::Serialize;

use super::finding::Finding;

const SUBJECT: &str = "recordings";
/// Room that a tick may take in a recording, in bytes: above what a run really takes (`tests/doctor` measures it).
pub const BYTES_PER_TICK: u64 = 120;
/// With less room than this, in bytes, no recording can even be begun.
const LEAST_BYTES: u64 = 1 << 20;

/// What there is.
#[derive(Clone, Debug, PartialEq)]
pub struct SpaceFacts {
    /// The folder for recordings.
    pub folder: PathBuf,
    /// The folder itself, or the nearest one around it that exists: there it will be made.
    pub existing: PathBuf,
    /// Whether that is a folder.
    pub is_folder: bool,
    /// Why it may not be written, in the system's words.
    pub refused: Option<String>,
    /// Free room in bytes.
    pub free_bytes: Option<u64>,
    /// Room for the longest configured run in bytes.
    pub needed_bytes: u64,
}

/// Figures of the room for recordings.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Space {
    /// The folder.
    pub folder: String,
    /// Free room in bytes.
    pub free_bytes: Option<u64>,
    /// Room for the longest configured run in bytes, at the most.
    pub needed_bytes: u64,
}

/// Looks at `folder`, for a run of so many ticks.
pub fn gather(folder: &Path, ticks: u64) -> SpaceFacts {
    let absolute = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
    let existing = absolute
        .ancestors()
        .find(|path| path.exists())
        .unwrap_or(Path::new("/"))
        .to_path_buf();
    let free = statvfs(&existing).map(|fs| fs.blocks_available() * fs.fragment_size());
    SpaceFacts {
        folder: folder.to_path_buf(),
        is_folder: existing.is_dir(),
        refused: eaccess(&existing, AccessFlags::W_OK | AccessFlags::X_OK)
            .err()
            .map(|error| error.to_string()),
        existing,
        free_bytes: free.ok(),
        needed_bytes: ticks.saturating_mul(BYTES_PER_TICK),
    }
}

impl SpaceFacts {
    /// The figures.
    pub fn figures(&self) -> Space {
        let (free_bytes, needed_bytes) = (self.free_bytes, self.needed_bytes);
        Space {
            folder: self.folder.display().to_string(),
            free_bytes,
            needed_bytes,
        }
    }
}

/// What that means.
pub fn findings(facts: &SpaceFacts) -> Vec<Finding> {
    let existing = facts.existing.display();
    if !facts.is_folder {
        let what = format!("{existing} is not a folder");
        return vec![Finding::failure(SUBJECT, what, "choose another with --out")];
    }
    if let Some(why) = &facts.refused {
        let what = format!("{existing} may not be written: {why}");
        return vec![Finding::failure(
            SUBJECT,
            what,
            "choose another with --out, or take ownership of it",
        )];
    }
    vec![room(facts)]
}

fn room(facts: &SpaceFacts) -> Finding {
    let megabytes = |bytes: u64| format!("{:.1} MB", bytes as f64 * 1e-6);
    let (folder, needed) = (facts.folder.display(), megabytes(facts.needed_bytes));
    let Some(free_bytes) = facts.free_bytes else {
        return Finding::note(
            SUBJECT,
            format!("{folder} can be written; its free room is unknown"),
            "`df` may tell",
        );
    };
    let what = format!(
        "{folder} can be written, {} free; the longest configured run takes {needed} at the most",
        megabytes(free_bytes)
    );
    match free_bytes {
        ..LEAST_BYTES => Finding::failure(
            SUBJECT,
            what,
            "free some room, or choose another folder with --out",
        ),
        _ if free_bytes < facts.needed_bytes => Finding::warning(
            SUBJECT,
            what,
            "free some room, or choose another folder with --out: a full disk stops the run",
        ),
        _ => Finding::ok(SUBJECT, what),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity;

    fn sound() -> SpaceFacts {
        SpaceFacts {
            folder: "recordings".into(),
            existing: "/data".into(),
            is_folder: true,
            refused: None,
            free_bytes: Some(1 << 30),
            needed_bytes: 72_000_000,
        }
    }

    #[test]
    fn each_trouble_has_its_verdict() {
        let cases = [
            (sound(), Severity::Ok),
            (
                SpaceFacts {
                    free_bytes: None,
                    ..sound()
                },
                Severity::Note,
            ),
            (
                SpaceFacts {
                    free_bytes: Some(50_000_000),
                    ..sound()
                },
                Severity::Warning,
            ),
            (
                SpaceFacts {
                    free_bytes: Some(4096),
                    ..sound()
                },
                Severity::Failure,
            ),
            (
                SpaceFacts {
                    refused: Some("EROFS".into()),
                    ..sound()
                },
                Severity::Failure,
            ),
            (
                SpaceFacts {
                    is_folder: false,
                    ..sound()
                },
                Severity::Failure,
            ),
        ];
        for (facts, expected) in cases {
            let found = findings(&facts);
            assert_eq!((found.len(), found[0].verdict), (1, expected), "{facts:?}");
            assert_eq!(found[0].remedy.is_some(), expected != Severity::Ok);
        }
    }

    #[test]
    fn a_folder_that_is_not_there_yet_is_looked_for_around_it_and_not_made() {
        let folder = tempfile::tempdir().unwrap();
        let facts = gather(&folder.path().join("a/b"), 1000);
        assert_eq!(facts.existing, folder.path());
        assert_eq!(
            (facts.is_folder, facts.refused.clone(), facts.needed_bytes),
            (true, None, 1000 * BYTES_PER_TICK)
        );
        assert!(facts.free_bytes.is_some() && !folder.path().join("a").exists());
    }

    #[test]
    fn a_file_in_the_way_is_found() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "").unwrap();
        assert_eq!(
            findings(&gather(&file.join("in"), 1))[0].what,
            format!("{} is not a folder", file.display())
        );
    }
}
