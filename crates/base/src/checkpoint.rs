//! Files that hold completed work, so that an interrupted command can continue.
//!
//! While a process works on such a file or folder it holds a [lock](super::locked) on it. The operating system releases the lock
//! however the process ends. Work is continued only with the settings that it was started with: [`differences`] names each setting
//! that differs.
//!
//! A [`RecordFile`] is appended line by line, each line `CHECKSUM JSON`. The first line is the header. The checksum
//! (CRC-32) of every other line covers header and line, so that a line of another file does not count. A line that a power
//! failure, a full disk or an editor has damaged is found by its checksum.

use std::fmt;
use std::fs::{File, TryLockError};
use std::io::{Seek, SeekFrom, Write};
use std::path::Path;

use serde_json::Value;

use super::input_file::{self, MAX_RECORD_BYTES};
use super::locked::{Locked, NotLocked};

/// The step that failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileAction {
    /// Creating a folder.
    Create,
    /// Opening.
    Open,
    /// Requesting the lock.
    Lock,
    /// Working on it: another process holds the lock.
    Use,
    /// Reading.
    Read,
    /// Writing.
    Write,
    /// Removing.
    Remove,
}

impl fmt::Display for FileAction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            FileAction::Create => "create",
            FileAction::Open => "open",
            FileAction::Lock => "lock",
            FileAction::Use => "use",
            FileAction::Read => "read",
            FileAction::Write => "write",
            FileAction::Remove => "remove",
        })
    }
}

/// A file or folder that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("cannot {action} {path}: {cause}")]
pub struct FileError {
    /// The step that failed.
    pub action: FileAction,
    /// The file or folder.
    pub path: String,
    /// The reason, as reported by the operating system.
    pub cause: String,
}

impl FileError {
    /// The error of one file operation.
    pub fn new(action: FileAction, path: &Path, cause: &impl fmt::Display) -> FileError {
        FileError {
            action,
            path: path.display().to_string(),
            cause: cause.to_string(),
        }
    }
}

/// Locks a file or folder for this process alone.
pub fn lock(file: File, path: &Path) -> Result<Locked, FileError> {
    Locked::exclusive(file).map_err(|refused| lock_error(refused, path))
}

/// Locks a file for reading: other readers may hold it too, a writer may not.
fn lock_for_reading(file: File, path: &Path) -> Result<Locked, FileError> {
    Locked::shared(file).map_err(|refused| lock_error(refused, path))
}

fn lock_error(refused: NotLocked, path: &Path) -> FileError {
    match refused.error {
        TryLockError::WouldBlock => {
            FileError::new(FileAction::Use, path, &"another `bench` is using it")
        }
        TryLockError::Error(e) => FileError::new(FileAction::Lock, path, &e),
    }
}

/// CRC-32 of some texts, one after the other, as eight hexadecimal digits.
pub fn checksum(texts: &[&str]) -> String {
    let mut checksum = crc32fast::Hasher::new();
    for text in texts {
        checksum.update(text.as_bytes());
    }
    format!("{:08x}", checksum.finalize())
}

/// One line for each setting in which two JSON texts differ: the stored one and that of this call.
pub fn differences(stored: &str, ours: &str) -> Vec<String> {
    let [stored, ours] =
        [stored, ours].map(|text| serde_json::from_str::<Value>(text).unwrap_or_default());
    let mut found = Vec::new();
    compare("", &stored, &ours, &mut found);
    found
}

fn compare(path: &str, stored: &Value, ours: &Value, found: &mut Vec<String>) {
    match (stored, ours) {
        (a, b) if a == b => {}
        (Value::Object(a), Value::Object(b)) => {
            let only_ours = b.keys().filter(|key| !a.contains_key(*key));
            for key in a.keys().chain(only_ours) {
                compare_entry(path, key, a.get(key), b.get(key), found);
            }
        }
        (Value::Array(a), Value::Array(b)) => {
            for index in 0..a.len().max(b.len()) {
                compare_entry(path, &index.to_string(), a.get(index), b.get(index), found);
            }
        }
        (a, b) => found.push(format!("  `{path}` is {a} there, {b} here")),
    }
}

fn compare_entry(
    path: &str,
    key: &str,
    stored: Option<&Value>,
    ours: Option<&Value>,
    found: &mut Vec<String>,
) {
    let path = match path {
        "" => key.to_string(),
        path => format!("{path}.{key}"),
    };
    let [stored, ours] = [stored, ours].map(|value| value.unwrap_or(&Value::Null));
    compare(&path, stored, ours, found);
}

/// An open file of records, locked for this process.
#[derive(Debug)]
pub struct RecordFile {
    file: Locked,
    path: String,
    header: String,
}

impl RecordFile {
    /// Opens or creates a file, locks it, and returns its content as it is.
    pub fn open(path: &Path, header: String) -> Result<(RecordFile, Vec<u8>), FileError> {
        let file = input_file::open_or_create(path)
            .map_err(|e| FileError::new(FileAction::Open, path, &e))?;
        let file = lock(file, path)?;
        let content = read(&file, path)?;
        let path = path.display().to_string();
        Ok((RecordFile { file, path, header }, content))
    }

    /// The header of this call.
    pub fn header(&self) -> &str {
        &self.header
    }

    /// Whether a content is that of a new file, or of one whose process ended while it wrote the header.
    pub fn is_new(&self, content: &[u8]) -> bool {
        record("", &self.header).as_bytes().starts_with(content)
    }

    /// Makes the file new: the header alone.
    pub fn start(&mut self) -> Result<(), FileError> {
        self.truncate(0)?;
        let first = record("", &self.header);
        self.write(&first)
    }

    /// Keeps the first `bytes` of the file and continues behind them.
    pub fn truncate(&mut self, bytes: u64) -> Result<(), FileError> {
        let shortened = self.file.set_len(bytes);
        let moved = shortened.and_then(|()| (&*self.file).seek(SeekFrom::Start(bytes)));
        moved.map(drop).map_err(|e| self.failed_to_write(&e))
    }

    /// Appends a record by one write.
    pub fn append(&mut self, json: &str) -> Result<(), FileError> {
        let line = record(&self.header, json);
        self.write(&line)
    }

    /// Waits until all records are on the disk.
    pub fn sync(&self) -> Result<(), FileError> {
        self.file.sync_all().map_err(|e| self.failed_to_write(&e))
    }

    fn write(&mut self, line: &str) -> Result<(), FileError> {
        let written = (&*self.file).write_all(line.as_bytes());
        written.map_err(|e| self.failed_to_write(&e))
    }

    fn failed_to_write(&self, error: &std::io::Error) -> FileError {
        FileError::new(FileAction::Write, Path::new(&self.path), error)
    }
}

/// The content of a file of records that another process may be reading as well.
pub fn read_records(path: &Path) -> Result<Vec<u8>, FileError> {
    let file = input_file::open(path).map_err(|e| FileError::new(FileAction::Open, path, &e))?;
    let file = lock_for_reading(file, path)?;
    read(&file, path)
}

fn read(file: &File, path: &Path) -> Result<Vec<u8>, FileError> {
    input_file::read_open(file, MAX_RECORD_BYTES)
        .map_err(|e| FileError::new(FileAction::Read, path, &e))
}

/// The lines of a file of records.
pub struct Records {
    text: String,
    /// Length of the complete lines in bytes.
    pub complete_bytes: u64,
    /// Whether an incomplete line follows them.
    pub is_torn: bool,
}

impl Records {
    /// The records in the content of a file.
    pub fn new(content: &[u8]) -> Records {
        let last = content.iter().rposition(|byte| *byte == b'\n');
        let complete = last.map_or(0, |end| end + 1);
        Records {
            text: String::from_utf8_lossy(&content[..complete]).into_owned(),
            complete_bytes: complete as u64,
            is_torn: complete < content.len(),
        }
    }

    /// The header; `None` where the first line is damaged or missing.
    pub fn header(&self) -> Option<&str> {
        self.text.lines().next().and_then(|line| verified("", line))
    }

    /// The JSON of each record behind the header; `None` where a line is damaged.
    pub fn records(&self) -> impl Iterator<Item = Option<&str>> {
        let header = self.header().unwrap_or_default();
        let lines = self.text.lines().skip(1);
        lines.map(move |line| verified(header, line))
    }
}

fn record(header: &str, json: &str) -> String {
    format!("{} {json}\n", checksum(&[header, json]))
}

/// The JSON of a line whose checksum is right.
fn verified<'a>(header: &str, line: &'a str) -> Option<&'a str> {
    let (sum, json) = line.split_once(' ')?;
    (sum == checksum(&[header, json])).then_some(json)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_each_setting_that_differs() {
        let found = differences(
            r#"{"a": 1, "b": {"c": [1, 2]}, "d": true}"#,
            r#"{"a": 1, "b": {"c": [1, 3, 4]}, "e": "x"}"#,
        );
        let expected = [
            "  `b.c.1` is 2 there, 3 here",
            "  `b.c.2` is null there, 4 here",
            "  `d` is true there, null here",
            "  `e` is null there, \"x\" here",
        ];
        assert_eq!(found, expected);
    }

    #[test]
    fn finds_damaged_and_torn_lines() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("records");
        let (mut file, content) = RecordFile::open(&path, "{}".into()).unwrap();
        assert!(file.is_new(&content));
        file.start().unwrap();
        for json in ["1", "2", "3"] {
            file.append(json).unwrap();
        }
        drop(file);
        let text = String::from_utf8(read_records(&path).unwrap()).unwrap();
        let damaged = text.replace(" 2\n", " 5\n") + "torn";
        let records = Records::new(damaged.as_bytes());
        assert_eq!(records.header(), Some("{}"));
        let found: Vec<Option<&str>> = records.records().collect();
        assert_eq!(found, [Some("1"), None, Some("3")]);
        assert!(records.is_torn && records.complete_bytes == text.len() as u64);
    }

    #[test]
    fn refuses_a_file_that_another_handle_has_locked() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("records");
        let (_file, _) = RecordFile::open(&path, "{}".into()).unwrap();
        let error = RecordFile::open(&path, "{}".into()).unwrap_err();
        assert_eq!(error.action, FileAction::Use);
        assert!(error.to_string().contains("another `bench` is using it"));
        assert_eq!(read_records(&path).unwrap_err().action, FileAction::Use);
    }
}
