//! The folder for recordings: whether it is writable and has enough space for a run. Nothing is created in it.

use std::path::{Path, PathBuf};

use nix::unistd::{AccessFlags, eaccess};
use serde::Serialize;

use super::finding::{Finding, Subject};
use bench_recording::{MIN_FREE_BYTES, free_bytes, nearest_existing, predicted_bytes};

/// Facts about the folder.
#[derive(Clone, Debug, PartialEq)]
pub struct SpaceFacts {
    /// The folder for recordings.
    pub folder: PathBuf,
    /// The folder itself, or its nearest existing ancestor.
    pub existing: PathBuf,
    /// Whether that is a folder.
    pub is_folder: bool,
    /// Why it is not writable, if it is not.
    pub not_writable: Option<String>,
    /// Free space in bytes.
    pub free_bytes: Option<u64>,
    /// Space for the longest configured run in bytes.
    pub needed_bytes: u64,
}

/// Space for recordings.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Space {
    /// The folder.
    pub folder: String,
    /// Free space in bytes.
    pub free_bytes: Option<u64>,
    /// Upper limit of the space for the longest configured run, in bytes.
    pub needed_bytes: u64,
}

/// Examines `folder`, for a run of `ticks`.
pub fn gather(folder: &Path, ticks: u64) -> SpaceFacts {
    let existing = nearest_existing(folder);
    let access = eaccess(&existing, AccessFlags::W_OK | AccessFlags::X_OK);
    SpaceFacts {
        folder: folder.to_path_buf(),
        is_folder: existing.is_dir(),
        not_writable: access.err().map(|error| error.to_string()),
        free_bytes: free_bytes(&existing),
        existing,
        needed_bytes: predicted_bytes(ticks),
    }
}

impl SpaceFacts {
    /// The figures.
    pub fn figures(&self) -> Space {
        Space {
            folder: self.folder.display().to_string(),
            free_bytes: self.free_bytes,
            needed_bytes: self.needed_bytes,
        }
    }
}

/// Evaluates the facts.
pub fn finding(facts: &SpaceFacts) -> Finding {
    let existing = facts.existing.display();
    if !facts.is_folder {
        let what = format!("{existing} is not a folder");
        return Subject::Recordings.failure(what, "choose another folder with --out");
    }
    if let Some(why) = &facts.not_writable {
        let remedy = "choose another folder with --out, or take ownership of this one";
        return Subject::Recordings.failure(format!("{existing} is not writable: {why}"), remedy);
    }
    match facts.free_bytes {
        Some(free_bytes) => space(facts, free_bytes),
        None => Subject::Recordings.note(
            format!("{existing} is writable; its free space is unknown"),
            "`df` may show it",
        ),
    }
}

fn space(facts: &SpaceFacts, free_bytes: u64) -> Finding {
    let what = format!(
        "{} is writable, {} free; the longest configured run needs up to {} and must leave {}",
        facts.folder.display(),
        megabytes(free_bytes),
        megabytes(facts.needed_bytes),
        megabytes(MIN_FREE_BYTES)
    );
    let remedy = "free some space, or choose another folder with --out";
    if free_bytes < MIN_FREE_BYTES {
        Subject::Recordings.failure(what, remedy)
    } else if free_bytes < facts.needed_bytes.saturating_add(MIN_FREE_BYTES) {
        Subject::Recordings.warning(
            what,
            format!("{remedy}: a run that does not fit is refused"),
        )
    } else {
        Subject::Recordings.ok(what)
    }
}

fn megabytes(bytes: u64) -> String {
    format!("{:.1} MB", bytes as f64 * 1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::Severity;

    fn healthy() -> SpaceFacts {
        SpaceFacts {
            folder: "recordings".into(),
            existing: "/data".into(),
            is_folder: true,
            not_writable: None,
            free_bytes: Some(1 << 30),
            needed_bytes: 72_000_000,
        }
    }

    #[test]
    fn each_defect_has_its_severity() {
        let severity = |change: fn(&mut SpaceFacts)| {
            let mut facts = healthy();
            change(&mut facts);
            let finding = finding(&facts);
            assert_eq!(finding.remedy.is_some(), finding.severity != Severity::Ok);
            finding.severity
        };
        assert_eq!(severity(|_| {}), Severity::Ok);
        assert_eq!(severity(|f| f.free_bytes = None), Severity::Note);
        assert_eq!(
            severity(|f| f.free_bytes = Some(150_000_000)),
            Severity::Warning,
            "72 MB and a reserve of 100 MB"
        );
        assert_eq!(
            severity(|f| f.free_bytes = Some(50_000_000)),
            Severity::Failure
        );
        assert_eq!(severity(|f| f.free_bytes = Some(4096)), Severity::Failure);
        assert_eq!(
            severity(|f| f.not_writable = Some("EROFS".into())),
            Severity::Failure
        );
        assert_eq!(severity(|f| f.is_folder = false), Severity::Failure);
    }

    #[test]
    fn a_folder_that_does_not_exist_is_judged_by_its_ancestor_and_not_created() {
        let folder = tempfile::tempdir().unwrap();
        let facts = gather(&folder.path().join("a/b"), 1000);
        assert_eq!(facts.existing, folder.path());
        assert_eq!((facts.is_folder, &facts.not_writable), (true, &None));
        assert_eq!(facts.needed_bytes, predicted_bytes(1000));
        assert!(facts.free_bytes.is_some() && !folder.path().join("a").exists());
    }

    #[test]
    fn a_file_in_place_of_the_folder_is_reported() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "").unwrap();
        let finding = finding(&gather(&file.join("in"), 1));
        assert_eq!(finding.what, format!("{} is not a folder", file.display()));
    }
}
