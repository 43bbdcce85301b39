//! The recordings in the folder of the daemon, with their data: operator, name, note, verdict. The data of a recording are in a small file
//! beside it, `NAME.info.json`.
//!
//! Only regular files of the folder itself belong to it: neither links, which may point anywhere, nor hidden files.

use std::fs::{DirEntry, File};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use bench_base::atomic_file::write_atomic;
use bench_base::input_file::read_open;
use bench_base::timestamp::unix_ns;

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
/// Largest file with the data of a recording: name and note have at most some thousand characters.
const MAX_INFO_BYTES: u64 = 64 << 10;

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
        let names: Vec<String> = entries?.iter().filter_map(name_of_file).collect();
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
        let metadata = std::fs::symlink_metadata(self.folder.join(file)).ok()?;
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

    /// The path of a file that may be downloaded; `None` for other names, and for what is not a regular file.
    pub fn path(&self, file: &str) -> Option<PathBuf> {
        let path = self.named(file)?;
        let found = std::fs::symlink_metadata(&path);
        found.is_ok_and(|found| found.is_file()).then_some(path)
    }

    /// Opens a file that may be downloaded; `None` for what [`path`](Self::path) does not name.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn open(&self, file: &str) -> io::Result<Option<File>> {
        let Some(path) = self.named(file) else {
            return Ok(None);
        };
        match open_regular(&path) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            opened => opened,
        }
    }

    /// The path of a file with a name that may be downloaded.
    fn named(&self, file: &str) -> Option<PathBuf> {
        let is_name = Path::new(file).file_name().is_some_and(|name| name == file);
        let extension = Path::new(file).extension()?.to_str()?;
        let is_public = is_name && !is_hidden(file) && DOWNLOADS.contains(&extension);
        is_public.then(|| self.folder.join(file))
    }

    /// The path of a recording.
    pub fn recording(&self, file: &str) -> Option<PathBuf> {
        self.path(file).filter(|_| is_recording(file))
    }

    /// What is known about a recording; nothing if its file is missing or cannot be read.
    pub fn info(&self, file: &str) -> RecordingInfo {
        let opened = open_regular(&self.info_path(file)).ok().flatten();
        let text = opened.and_then(|file| read_open(&file, MAX_INFO_BYTES).ok());
        serde_json::from_slice(&text.unwrap_or_default()).unwrap_or_default()
    }

    /// Whether a path in the folder, with all links that it follows, leaves the folder. One that does not exist does not.
    pub fn leaves(&self, path: &str) -> bool {
        let found = self.folder.join(path).canonicalize();
        found.is_ok_and(|found| !found.starts_with(&self.folder))
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

/// Opens a regular file for reading; `None` for everything else. A link is not followed, and a FIFO is not waited for.
fn open_regular(path: &Path) -> io::Result<Option<File>> {
    let flags = libc::O_NOFOLLOW | libc::O_NONBLOCK;
    let opened = File::options().read(true).custom_flags(flags).open(path);
    match opened {
        Ok(file) => Ok(file.metadata()?.is_file().then_some(file)),
        // A link; a socket or a device without a driver.
        Err(error) if matches!(error.raw_os_error(), Some(libc::ELOOP | libc::ENXIO)) => Ok(None),
        Err(error) => Err(error),
    }
}

/// The name of a regular file that is not hidden.
fn name_of_file(entry: &DirEntry) -> Option<String> {
    let is_file = entry.file_type().is_ok_and(|kind| kind.is_file());
    let name = entry.file_name().into_string().ok()?;
    (is_file && !is_hidden(&name)).then_some(name)
}

fn is_hidden(file: &str) -> bool {
    file.starts_with('.')
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
    fn links_and_hidden_files_do_not_belong_to_the_folder() {
        let (folder, outside) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let inside = |name: &str| folder.path().join(name);
        let secret = outside.path().join("secret.mcap");
        std::fs::write(&secret, r#"{"note":"secret"}"#).unwrap();
        std::fs::write(inside(".bench-daemon.json"), "{}").unwrap();
        std::fs::write(inside(".hidden.mcap"), "x").unwrap();
        std::fs::write(inside("a.mcap"), "x").unwrap();
        for name in ["link.mcap", "link.csv", "a.info.json", "a.csv"] {
            std::os::unix::fs::symlink(&secret, inside(name)).unwrap();
        }
        std::os::unix::fs::symlink("a.mcap", inside("inner.mcap")).unwrap();
        nix::unistd::mkfifo(&inside("fifo.mcap"), nix::sys::stat::Mode::S_IRUSR).unwrap();
        std::fs::create_dir(inside("folder.mcap")).unwrap();
        let catalogue = Catalogue::new(folder.path().into());
        for name in [
            ".bench-daemon.json",
            ".hidden.mcap",
            "link.mcap",
            "link.csv",
            "inner.mcap",
            "fifo.mcap",
            "folder.mcap",
        ] {
            assert_eq!(catalogue.path(name), None, "{name}");
            assert!(catalogue.open(name).unwrap().is_none(), "{name}");
        }
        assert!(catalogue.open("a.mcap").unwrap().is_some());
        let listed = catalogue.list().unwrap();
        let [only] = &listed[..] else {
            panic!("{listed:?}")
        };
        assert_eq!((only.file.as_str(), only.files.len()), ("a.mcap", 0));
        assert_eq!(only.info, RecordingInfo::default());
    }

    #[test]
    fn links_of_an_argument_are_followed_inside_only() {
        let (folder, outside) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        let inside = |name: &str| folder.path().join(name);
        std::fs::write(inside("own.csv"), "x").unwrap();
        std::fs::write(outside.path().join("x.csv"), "x").unwrap();
        std::os::unix::fs::symlink("own.csv", inside("inner.csv")).unwrap();
        std::os::unix::fs::symlink(outside.path(), inside("out")).unwrap();
        std::os::unix::fs::symlink("out/x.csv", inside("chain.csv")).unwrap();
        let catalogue = Catalogue::new(folder.path().canonicalize().unwrap());
        for name in ["own.csv", "inner.csv", "absent.csv", "", "0.1mm/s"] {
            assert!(!catalogue.leaves(name), "{name}");
        }
        for name in ["out", "out/x.csv", "chain.csv"] {
            assert!(catalogue.leaves(name), "{name}");
        }
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
