//! The completed part of a study, in a [`RecordFile`]: the header with format, version, shard and plan, then blocks of
//! draws in the order in which they were completed. The draws of a damaged line are computed again.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Block, Plan, Results, Shard, StudyError};
use bench_base::checkpoint::{FileAction, FileError, RecordFile, Records};
use bench_base::checkpoint::{differences, read_records};

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
        json(&Header {
            format: FORMAT.into(),
            version: env!("CARGO_PKG_VERSION").into(),
            shard,
            plan: plan.clone(),
        })
    }
}

/// A study file that this process works on.
#[derive(Debug)]
pub struct StudyFile {
    file: RecordFile,
}

/// A study file with its content.
#[derive(Debug)]
pub struct Opened {
    /// The file, to append to.
    pub file: StudyFile,
    /// The completed draws.
    pub results: Results,
    /// Number of damaged lines, which were left out.
    pub dropped: usize,
}

impl StudyFile {
    /// Opens or creates the file of a shard. Refuses a file of another kind or other settings, or one that another process
    /// is using, and leaves it unchanged.
    pub fn open(path: &Path, plan: &Plan, shard: Shard) -> Result<Opened, StudyError> {
        let (mut file, found) = RecordFile::open(path, Header::json(plan, shard))?;
        if file.is_new(&found) {
            file.start()?;
            let results = Results::none(plan.clone(), shard);
            return Ok(Opened {
                file: StudyFile { file },
                results,
                dropped: 0,
            });
        }
        let content = Content::read(path, &found)?;
        check_settings(&content, file.header())?;
        file.truncate(content.complete_bytes)?;
        Ok(Opened {
            file: StudyFile { file },
            results: content.results,
            dropped: content.dropped,
        })
    }

    /// Appends a block.
    pub fn append(&mut self, block: &Block) -> Result<(), StudyError> {
        Ok(self.file.append(&json(block))?)
    }

    /// Waits until all blocks are on the disk.
    pub fn sync(&self) -> Result<(), StudyError> {
        Ok(self.file.sync()?)
    }
}

impl From<FileError> for StudyError {
    fn from(error: FileError) -> StudyError {
        let remedy = match error.action {
            FileAction::Write => {
                "free some space and start the study again with the same arguments (the draws done so far are stored)"
            }
            FileAction::Use => "wait until that process ends, or choose another file",
            _ => "check that you may read and write the file",
        };
        StudyError::File { error, remedy }
    }
}

/// The content of a study file.
struct Content {
    path: String,
    header: String,
    results: Results,
    /// Length of the complete lines in bytes.
    complete_bytes: u64,
    /// Number of damaged lines.
    dropped: usize,
}

impl Content {
    fn read(path: &Path, bytes: &[u8]) -> Result<Content, StudyError> {
        let path = path.display().to_string();
        Content::parse(&path, bytes).map_err(|why| StudyError::NotAStudy { path, why })
    }

    fn parse(path: &str, bytes: &[u8]) -> Result<Content, String> {
        let records = Records::new(bytes);
        let first = records
            .header()
            .ok_or("its first line is not that of a study")?;
        let header = parse_header(first)?;
        let mut results = Results::none(header.plan, header.shard);
        let damaged = records
            .records()
            .filter(|json| !add_block(&mut results, *json))
            .count();
        Ok(Content {
            path: path.into(),
            header: first.to_string(),
            results,
            complete_bytes: records.complete_bytes,
            dropped: damaged + usize::from(records.is_torn),
        })
    }
}

fn parse_header(json: &str) -> Result<Header, String> {
    let header: Header = serde_json::from_str(json)
        .map_err(|e| format!("its first line is that of another version: {e}"))?;
    if header.format != FORMAT || !header.shard.is_valid() {
        let format = header.format;
        return Err(format!("its format is `{format}`, not `{FORMAT}`"));
    }
    Ok(header)
}

/// Adds the block of a record; `false` where it is damaged.
fn add_block(results: &mut Results, json: Option<&str>) -> bool {
    let block = json.and_then(|json| serde_json::from_str::<Block>(json).ok());
    block.is_some_and(|block| results.add(block))
}

/// Refuses a file of other settings.
fn check_settings(content: &Content, expected: &str) -> Result<(), StudyError> {
    let differences = differences(&content.header, expected);
    if differences.is_empty() {
        Ok(())
    } else {
        Err(StudyError::OtherSettings {
            path: content.path.clone(),
            differences,
        })
    }
}

/// The complete study from the files of its shards. Refuses files of different settings, and names the shards that are
/// missing, given twice, or incomplete.
pub fn joined(paths: &[PathBuf]) -> Result<Results, StudyError> {
    let parts = paths
        .iter()
        .map(|path| Content::read(path, &read_records(path)?))
        .collect::<Result<Vec<_>, _>>()?;
    let Some(first) = parts.first() else {
        return Err(StudyError::Plan(
            "no file to join; give --join FILE...".into(),
        ));
    };
    same_study(&parts, first)?;
    let findings = findings(&parts);
    if !findings.is_empty() {
        return Err(StudyError::Shards(findings));
    }
    let mut whole = Results::none(first.results.plan.clone(), Shard::WHOLE);
    for part in parts {
        whole.absorb(part.results);
    }
    Ok(whole)
}

fn same_study(parts: &[Content], first: &Content) -> Result<(), StudyError> {
    let expected = without_index(&first.header);
    for part in parts {
        let differences = differences(&without_index(&part.header), &expected);
        if !differences.is_empty() {
            let path = part.path.clone();
            return Err(StudyError::OtherSettings { path, differences });
        }
    }
    Ok(())
}

/// The header without the index of its shard.
fn without_index(header: &str) -> String {
    let mut header: Value = serde_json::from_str(header).unwrap_or_default();
    header["shard"]["index"] = Value::Null;
    header.to_string()
}

/// A line for each reason why the files are not a complete study.
fn findings(parts: &[Content]) -> Vec<String> {
    let given: BTreeSet<u64> = parts.iter().map(|part| part.results.shard.index).collect();
    let twice = given.iter().filter_map(|index| given_twice(parts, *index));
    let incomplete = parts.iter().filter_map(incomplete);
    let missing = missing_shards(parts, &given).into_iter();
    missing.chain(twice).chain(incomplete).collect()
}

fn missing_shards(parts: &[Content], given: &BTreeSet<u64>) -> Option<String> {
    let count = parts.first()?.results.shard.count;
    let missing: Vec<String> = (1..=count)
        .filter(|index| !given.contains(index))
        .map(|index| index.to_string())
        .collect();
    let names = missing.join(", ");
    (!missing.is_empty()).then(|| format!("  missing shards: {names} of {count}"))
}

fn given_twice(parts: &[Content], index: u64) -> Option<String> {
    let files = parts
        .iter()
        .filter(|part| part.results.shard.index == index);
    let names: Vec<&str> = files.clone().map(|part| part.path.as_str()).collect();
    let shard = files.map(|part| part.results.shard).next()?;
    (names.len() > 1).then(|| {
        let names = names.join(", ");
        format!("  shard {shard} is given more than once: {names}")
    })
}

fn incomplete(part: &Content) -> Option<String> {
    let missing = part.results.missing();
    let draws: u64 = missing.iter().map(|range| range.end - range.start).sum();
    let (first, path, shard) = (missing.first()?.start, &part.path, part.results.shard);
    Some(format!(
        "  {path} (shard {shard}) lacks {draws} draws, from {first} on: continue it with its own arguments"
    ))
}

fn json(value: &impl Serialize) -> String {
    // Numbers, strings and lists of them can always be converted to JSON.
    serde_json::to_string(value).unwrap_or_default()
}
