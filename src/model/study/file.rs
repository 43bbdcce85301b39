//! What is done of a study, in a file.
//!
//! One line a record, each `CHECKSUM JSON`: the header with format, version, shard and plan, then blocks of draws as they
//! were done. A block is appended by one write; its checksum (CRC-32) is over header and block. What a power cut, a full disk
//! or a hand left of a line is found, dropped, and its draws are done again.
//!
//! While a process works on the file it holds a lock on it, which the system takes back however the process ends.

use std::fs::{File, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Block, Plan, Results, Shard, StudyError};

const FORMAT: &str = "bench study 1";

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Header {
    format: String,
    version: String,
    shard: Shard,
    #[serde(flatten)]
    plan: Plan,
}

impl Header {
    fn json(plan: &Plan, shard: Shard) -> String {
        let (format, version) = (FORMAT.into(), env!("CARGO_PKG_VERSION").into());
        json(&Header {
            format,
            version,
            shard,
            plan: plan.clone(),
        })
    }
}

/// A file that is being worked on.
#[derive(Debug)]
pub struct StudyFile {
    file: File,
    path: String,
    header: String,
}

/// A file as it was found or made.
#[derive(Debug)]
pub struct Opened {
    /// The file, to append to.
    pub file: StudyFile,
    /// What is in it.
    pub results: Results,
    /// Lines that were damaged, and do not count.
    pub dropped: usize,
}

impl StudyFile {
    /// Opens the file of a shard, or makes it. Refuses one of anything else, or one that another process works on, and leaves
    /// it as it is.
    pub fn open(path: &Path, plan: &Plan, shard: Shard) -> Result<Opened, StudyError> {
        let name = path.display().to_string();
        let options = File::options()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path);
        let file = options.map_err(|e| failed("open", &name, &e))?;
        lock(file.try_lock(), &name)?;
        let mut file = StudyFile {
            file,
            path: name,
            header: Header::json(plan, shard),
        };
        let found = file.read()?;
        let first = record("", &file.header);
        if first.as_bytes().starts_with(&found) {
            // New; or its process died while it wrote the first line.
            file.cut(0)?;
            file.write(&first)?;
            return Ok(Opened {
                file,
                results: Results::none(plan.clone(), shard),
                dropped: 0,
            });
        }
        let content = Content::of(&found).map_err(|why| StudyError::NotAStudy {
            path: file.path.clone(),
            why,
        })?;
        let differences = differences(&content.header, &file.header);
        if !differences.is_empty() {
            return Err(StudyError::Other {
                path: file.path,
                differences,
            });
        }
        file.cut(content.whole)?;
        Ok(Opened {
            file,
            results: content.results,
            dropped: content.dropped,
        })
    }

    /// Appends a block.
    pub fn append(&mut self, block: &Block) -> Result<(), StudyError> {
        self.write(&record(&self.header, &json(block)))
    }

    /// Waits until all of it is on the disk.
    pub fn sync(&self) -> Result<(), StudyError> {
        self.file
            .sync_all()
            .map_err(|e| failed("write", &self.path, &e))
    }

    fn read(&mut self) -> Result<Vec<u8>, StudyError> {
        let mut found = Vec::new();
        self.file
            .read_to_end(&mut found)
            .map_err(|e| failed("read", &self.path, &e))?;
        Ok(found)
    }

    /// Leaves so many bytes, and goes on behind them.
    fn cut(&mut self, bytes: u64) -> Result<(), StudyError> {
        let cut = self
            .file
            .set_len(bytes)
            .and_then(|()| self.file.seek(SeekFrom::Start(bytes)));
        cut.map(drop).map_err(|e| failed("write", &self.path, &e))
    }

    fn write(&mut self, line: &str) -> Result<(), StudyError> {
        self.file
            .write_all(line.as_bytes())
            .map_err(|e| failed("write", &self.path, &e))
    }
}

/// What stands in a file.
struct Content {
    header: String,
    results: Results,
    /// Bytes of whole lines.
    whole: u64,
    /// Lines that do not count.
    dropped: usize,
}

impl Content {
    /// Or why it is no study.
    fn of(bytes: &[u8]) -> Result<Content, String> {
        let whole = bytes
            .iter()
            .rposition(|byte| *byte == b'\n')
            .map_or(0, |end| end + 1);
        let text = String::from_utf8_lossy(&bytes[..whole]);
        let mut lines = text.lines();
        let first = lines
            .next()
            .and_then(|line| checked("", line))
            .ok_or("its first line is not a study's")?;
        let header: Header = serde_json::from_str(first)
            .map_err(|e| format!("its first line is another version's: {e}"))?;
        if header.format != FORMAT || !header.shard.is_one() {
            return Err(format!("its format is `{}`, not `{FORMAT}`", header.format));
        }
        let mut results = Results::none(header.plan, header.shard);
        let block =
            |line| checked(first, line).and_then(|json| serde_json::from_str::<Block>(json).ok());
        let damaged = lines
            .filter(|line| !block(line).is_some_and(|block| results.add(block)))
            .count();
        let torn = usize::from(whole < bytes.len());
        Ok(Content {
            header: first.to_string(),
            results,
            whole: whole as u64,
            dropped: damaged + torn,
        })
    }
}

/// The study that files of shards make up together. Refuses those of other settings, and says which shards are missing, are
/// there twice, or are not done.
pub fn joined(paths: &[PathBuf]) -> Result<Results, StudyError> {
    let parts = paths
        .iter()
        .map(|path| part(path))
        .collect::<Result<Vec<_>, _>>()?;
    let Some((first, _)) = parts.first() else {
        return Err(StudyError::Plan(
            "no file to join; give --join FILE...".into(),
        ));
    };
    for (content, path) in &parts {
        let differences = differences(&shardless(&content.header), &shardless(&first.header));
        if !differences.is_empty() {
            return Err(StudyError::Other {
                path: path.clone(),
                differences,
            });
        }
    }
    let findings = findings(&parts);
    if !findings.is_empty() {
        return Err(StudyError::Shards(findings));
    }
    let mut whole = Results::none(first.results.plan.clone(), Shard::WHOLE);
    parts
        .into_iter()
        .for_each(|(content, _)| whole.absorb(content.results));
    Ok(whole)
}

fn part(path: &Path) -> Result<(Content, String), StudyError> {
    let name = path.display().to_string();
    let mut file = File::open(path).map_err(|e| failed("open", &name, &e))?;
    lock(file.try_lock_shared(), &name)?;
    let mut bytes = Vec::new();
    file.read_to_end(&mut bytes)
        .map_err(|e| failed("read", &name, &e))?;
    match Content::of(&bytes) {
        Ok(content) => Ok((content, name)),
        Err(why) => Err(StudyError::NotAStudy { path: name, why }),
    }
}

/// The header as that of a whole study of as many shards.
fn shardless(header: &str) -> String {
    let mut header: Value = serde_json::from_str(header).unwrap_or_default();
    header["shard"]["index"] = Value::Null;
    header.to_string()
}

fn findings(parts: &[(Content, String)]) -> Vec<String> {
    let count = parts
        .first()
        .map_or(0, |(content, _)| content.results.shard.count);
    let of = |index: u64| {
        parts
            .iter()
            .filter(move |(content, _)| content.results.shard.index == index)
    };
    let absent: Vec<String> = (1..=count)
        .filter(|&index| of(index).next().is_none())
        .map(|i| i.to_string())
        .collect();
    let absent = (!absent.is_empty()).then(|| {
        format!(
            "  of {count} shards there is no file of {}",
            absent.join(", ")
        )
    });
    let twice = |index: u64| {
        let names: Vec<&str> = of(index).map(|(_, name)| name.as_str()).collect();
        (names.len() > 1).then(|| {
            format!(
                "  shard {index}/{count} is there more than once: {}",
                names.join(", ")
            )
        })
    };
    let twice = parts
        .iter()
        .map(|(content, _)| content.results.shard.index)
        .collect::<std::collections::BTreeSet<_>>()
        .into_iter()
        .filter_map(twice);
    absent
        .into_iter()
        .chain(twice)
        .chain(parts.iter().filter_map(not_done))
        .collect()
}

fn not_done((content, name): &(Content, String)) -> Option<String> {
    let (results, missing) = (&content.results, content.results.missing());
    let draws: u64 = missing.iter().map(|range| range.end - range.start).sum();
    let first = missing.first()?.start;
    let shard = results.shard;
    Some(format!(
        "  {name} (shard {shard}) lacks {draws} draws, from {first} on: start it again with the arguments it was made with"
    ))
}

fn json(value: &impl Serialize) -> String {
    // Numbers, words and lists of them are always JSON.
    serde_json::to_string(value).unwrap_or_default()
}

fn checksum(header: &str, json: &str) -> String {
    let mut checksum = crc32fast::Hasher::new();
    checksum.update(header.as_bytes());
    checksum.update(json.as_bytes());
    format!("{:08x}", checksum.finalize())
}

fn record(header: &str, json: &str) -> String {
    format!("{} {json}\n", checksum(header, json))
}

/// The JSON of a line whose checksum holds.
fn checked<'a>(header: &str, line: &'a str) -> Option<&'a str> {
    let (sum, json) = line.split_once(' ')?;
    (sum == checksum(header, json)).then_some(json)
}

/// A line for each setting in which two headers differ, both JSON.
pub(crate) fn differences(theirs: &str, ours: &str) -> Vec<String> {
    let [theirs, ours] =
        [theirs, ours].map(|text| serde_json::from_str::<Value>(text).unwrap_or_default());
    let mut found = Vec::new();
    differ("", &theirs, &ours, &mut found);
    found
}

fn differ(path: &str, theirs: &Value, ours: &Value, found: &mut Vec<String>) {
    let below = |key: &str| {
        if path.is_empty() {
            key.to_string()
        } else {
            format!("{path}.{key}")
        }
    };
    match (theirs, ours) {
        (a, b) if a == b => {}
        (Value::Object(a), Value::Object(b)) => {
            for key in a.keys().chain(b.keys().filter(|key| !a.contains_key(*key))) {
                let [a, b] = [a, b].map(|table| table.get(key).unwrap_or(&Value::Null));
                differ(&below(key), a, b, found);
            }
        }
        (Value::Array(a), Value::Array(b)) => {
            for index in 0..a.len().max(b.len()) {
                let [a, b] = [a, b].map(|list| list.get(index).unwrap_or(&Value::Null));
                differ(&below(&index.to_string()), a, b, found);
            }
        }
        (a, b) => found.push(format!("  `{path}` is {a} there, {b} here")),
    }
}

fn lock(locked: Result<(), TryLockError>, path: &str) -> Result<(), StudyError> {
    match locked {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(StudyError::File {
            what: "use",
            path: path.into(),
            why: "another `bench` is at work on it".into(),
            remedy: "wait for it, or name another file",
        }),
        Err(TryLockError::Error(e)) => Err(failed("lock", path, &e)),
    }
}

fn failed(what: &'static str, path: &str, error: &std::io::Error) -> StudyError {
    let remedy = match what {
        "write" => {
            "what is done so far is kept: make room and start it again with the same arguments"
        }
        _ => "check that the file can be read and written",
    };
    StudyError::File {
        what,
        path: path.into(),
        why: error.to_string(),
        remedy,
    }
}
