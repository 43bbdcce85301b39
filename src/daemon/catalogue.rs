//! The recordings in the folder of the daemon, with their data: operator, name, note, verdict. The data of a recording are in a small file
//! beside it, `NAME.info.json`.

use std::io;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::util::atomic_file::write_atomic;
use crate::util::timestamp::unix_ns;

/// Data of a recording that are not in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct RecordingInfo {
    /// The command that made it.
    pub command: String,
    /// The operator.
    pub operator: String,
    /// Name given by the operator.
    pub name: String,
    /// Note of the operator.
    pub note: String,
    /// How the run ended.
    pub outcome: Option<String>,
    /// The verdict about CNMP zeros: `yes`, `no` or `undecided`.
    pub verdict: Option<String>,
}

/// A recording of the list.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ListedRecording {
    /// Name of its file.
    pub file: String,
    /// Size in bytes.
    pub bytes: u64,
    /// Last change in seconds since 1970.
    pub changed_unix_s: f64,
    /// Its data.
    #[serde(flatten)]
    pub info: RecordingInfo,
    /// Files that were computed from it.
    pub files: Vec<String>,
}

/// The folder of the recordings.
#[derive(Clone, Debug)]
pub struct Catalogue {
    folder: PathBuf,
}

/// Extension of a recording.
const EXTENSION: &str = "mcap";
/// What follows the name of a recording in the name of its knowledge.
const INFO: &str = ".info.json";
/// Extensions of files that may be downloaded.
const DOWNLOADS: [&str; 6] = ["mcap", "csv", "svg", "html", "json", "toml"];

impl Catalogue {
    /// The recordings of a folder.
    pub fn new(folder: PathBuf) -> Catalogue {
        Catalogue { folder }
    }

    /// All recordings, newest first.
    ///
    /// # Errors
    /// When the folder cannot be read.
    pub fn list(&self) -> io::Result<Vec<ListedRecording>> {
        let entries: io::Result<Vec<_>> = std::fs::read_dir(&self.folder)?.collect();
        let names: Vec<String> = entries?
            .iter()
            .filter_map(|entry| entry.file_name().into_string().ok())
            .collect();
        let recordings = names.iter().filter(|name| is_recording(name));
        let listed = recordings.filter_map(|name| self.listed(name, &names));
        let mut listed: Vec<ListedRecording> = listed.collect();
        listed.sort_by(|a, b| {
            b.changed_unix_s
                .total_cmp(&a.changed_unix_s)
                .then(b.file.cmp(&a.file))
        });
        Ok(listed)
    }

    /// A recording that was removed in the meantime is left out.
    fn listed(&self, file: &str, names: &[String]) -> Option<ListedRecording> {
        let metadata = std::fs::metadata(self.folder.join(file)).ok()?;
        let changed = metadata.modified().unwrap_or(SystemTime::UNIX_EPOCH);
        let stem = stem(file);
        let others = names
            .iter()
            .filter(|name| *name != file && belongs_to(name, stem));
        let files = others.filter(|name| !name.ends_with(INFO)).cloned();
        Some(ListedRecording {
            file: file.into(),
            bytes: metadata.len(),
            changed_unix_s: unix_ns(changed) as f64 * 1e-9,
            info: self.info(file),
            files: files.collect(),
        })
    }

    /// The path of a file that may be downloaded; `None` for other names.
    pub fn path(&self, file: &str) -> Option<PathBuf> {
        let is_name = Path::new(file).file_name().is_some_and(|name| name == file);
        let extension = Path::new(file).extension()?.to_str()?;
        let path = self.folder.join(file);
        (is_name && DOWNLOADS.contains(&extension) && path.is_file()).then_some(path)
    }

    /// The path of a recording.
    pub fn recording(&self, file: &str) -> Option<PathBuf> {
        self.path(file).filter(|_| is_recording(file))
    }

    /// What is known about a recording; nothing if its file is missing or cannot be read.
    pub fn info(&self, file: &str) -> RecordingInfo {
        let text = std::fs::read(self.info_path(file)).unwrap_or_default();
        serde_json::from_slice(&text).unwrap_or_default()
    }

    /// Stores what is known about a recording.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn set_info(&self, file: &str, info: &RecordingInfo) -> io::Result<()> {
        let text = serde_json::to_string_pretty(info).map_err(io::Error::other)?;
        write_atomic(&self.info_path(file), &(text + "\n")).map_err(io::Error::other)
    }

    /// Removes a recording and the files computed from it.
    ///
    /// # Errors
    /// When a file cannot be removed.
    pub fn remove(&self, file: &str) -> io::Result<()> {
        let stem = stem(file).to_string();
        for entry in std::fs::read_dir(&self.folder)? {
            let entry = entry?;
            let name = entry.file_name();
            if name.to_str().is_some_and(|name| belongs_to(name, &stem)) {
                std::fs::remove_file(entry.path())?;
            }
        }
        Ok(())
    }

    fn info_path(&self, file: &str) -> PathBuf {
        self.folder.join(format!("{}{INFO}", stem(file)))
    }
}

fn is_recording(file: &str) -> bool {
    Path::new(file)
        .extension()
        .is_some_and(|extension| extension == EXTENSION)
}

fn stem(file: &str) -> &str {
    file.strip_suffix(&format!(".{EXTENSION}")).unwrap_or(file)
}

/// Whether a file is that of a recording: `STEM.x`, `STEM_x.y`, but not that of another recording whose name begins with the stem.
fn belongs_to(name: &str, stem: &str) -> bool {
    let Some(rest) = name.strip_prefix(stem) else {
        return false;
    };
    rest == format!(".{EXTENSION}") || (rest.starts_with(['.', '_']) && !is_recording(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_and_removes_a_recording_with_its_files_only() {
        let folder = tempfile::tempdir().unwrap();
        for name in [
            "a.mcap",
            "a.csv",
            "a_loop.csv",
            "a.info.json",
            "a-2.mcap",
            "a-2.csv",
        ] {
            std::fs::write(folder.path().join(name), "x").unwrap();
        }
        let catalogue = Catalogue::new(folder.path().into());
        let listed = catalogue.list().unwrap();
        let first = listed
            .iter()
            .find(|listed| listed.file == "a.mcap")
            .unwrap();
        let mut files = first.files.clone();
        files.sort();
        assert_eq!(files, ["a.csv", "a_loop.csv"]);
        catalogue.remove("a.mcap").unwrap();
        let left = catalogue.list().unwrap();
        assert_eq!(left.len(), 1);
        assert_eq!(left[0].files, ["a-2.csv"]);
    }

    #[test]
    fn refuses_paths_and_other_files() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("token"), "secret").unwrap();
        std::fs::write(folder.path().join("a.mcap"), "x").unwrap();
        let catalogue = Catalogue::new(folder.path().into());
        for name in ["../a.mcap", "/etc/passwd", "token", "", ".", "b.mcap"] {
            assert_eq!(catalogue.path(name), None, "{name}");
        }
        assert!(catalogue.path("a.mcap").is_some());
    }

    #[test]
    fn keeps_what_is_known() {
        let folder = tempfile::tempdir().unwrap();
        let catalogue = Catalogue::new(folder.path().into());
        let info = RecordingInfo {
            note: "with the new flexure".into(),
            ..RecordingInfo::default()
        };
        catalogue.set_info("a.mcap", &info).unwrap();
        assert_eq!(catalogue.info("a.mcap"), info);
        assert_eq!(catalogue.info("b.mcap"), RecordingInfo::default());
    }
}
