//! Opens recordings, complete or cut off.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::contents::{Contents, Part};
use super::continuity::{Continuity, Gap};
use super::digest::Digest;
use super::messages::Timing;
use super::stream::{Stream, Ticks, decode, published};
use super::walk::{Stop, Walk};
use super::{CONFIG_ATTACHMENT, METADATA_RECORD, RecordingError, Topic};
use crate::rt::record::{Event, LoopMessage};

/// A file inside the recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StoredAttachment {
    /// Its name.
    pub name: String,
    /// Its media type.
    pub media_type: String,
    /// Its content.
    pub data: Vec<u8>,
}

/// The end of the readable part of a recording that is not complete.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Cut {
    /// The file is readable up to this byte.
    pub at_byte: u64,
    /// Size of the file.
    pub of_bytes: u64,
    /// What is wrong there.
    pub why: String,
}

/// A recording that was read once from start to end. All checks have passed, everything except the ticks is in
/// memory, and the ticks can be streamed any number of times.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    cut: Option<Cut>,
    found: RecordingContents,
}

/// The contents of the file, without the ticks.
#[derive(Debug, Default)]
struct RecordingContents {
    metadata: BTreeMap<String, String>,
    attachments: Vec<StoredAttachment>,
    events: Vec<Event>,
    timings: Vec<Timing>,
    gaps: Vec<Gap>,
    account: Continuity,
    digest: Digest,
}

impl Recording {
    /// Opens a recording. A file that ends early is read up to its end, see [`Recording::truncated`]; a damaged file is refused.
    pub fn open(path: &Path) -> Result<Recording, RecordingError> {
        Recording::read(path, false)
    }

    /// As [`Recording::open`], but a damaged file is treated as cut off at the first damage.
    pub fn salvage(path: &Path) -> Result<Recording, RecordingError> {
        Recording::read(path, true)
    }

    fn read(path: &Path, salvage: bool) -> Result<Recording, RecordingError> {
        let mut walk = Walk::new(open(path)?);
        let mut found = RecordingContents::default();
        let stop = loop {
            match walk.step(&mut |part| found.take(part)) {
                Ok(true) => {}
                Ok(false) => break None,
                Err(stop) => break Some(stop),
            }
        };
        let cut = stop
            .map(|stop| judge(path, stop, walk.offset, &found, salvage))
            .transpose()?;
        require_ticks(path, &walk.contents, &found, cut.is_some())?;
        Ok(Recording {
            path: path.into(),
            cut,
            found,
        })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the recording was not finished.
    pub fn truncated(&self) -> bool {
        self.cut.is_some()
    }

    /// The end of the readable part, if the recording was not finished.
    pub fn cut(&self) -> Option<&Cut> {
        self.cut.as_ref()
    }

    /// The effective configuration of the run.
    pub fn config_toml(&self) -> Option<&str> {
        self.attachment(CONFIG_ATTACHMENT)
            .and_then(|a| std::str::from_utf8(&a.data).ok())
    }

    /// Version of the program, host, scheduling, `period_ns` and other properties of the run.
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.found.metadata
    }

    /// Period of the loop, if it is recorded.
    pub fn period_ns(&self) -> Option<u64> {
        self.found.metadata.get("period_ns")?.parse().ok()
    }

    /// All attachments, in the order of the file.
    pub fn attachments(&self) -> &[StoredAttachment] {
        &self.found.attachments
    }

    /// The first attachment of that name.
    pub fn attachment(&self, name: &str) -> Option<&StoredAttachment> {
        self.found.attachments.iter().find(|a| a.name == name)
    }

    /// All events, in the order in which the loop published them.
    pub fn events(&self) -> &[Event] {
        &self.found.events
    }

    /// The summaries of `/timing`, one for each second.
    pub fn timings(&self) -> &[Timing] {
        &self.found.timings
    }

    /// Number of recorded ticks.
    pub fn tick_count(&self) -> u64 {
        self.found.account.ticks()
    }

    /// Number of the first tick.
    pub fn first_tick(&self) -> u64 {
        self.found.account.first_tick().unwrap_or_default()
    }

    /// Number of the last tick.
    pub fn last_tick(&self) -> u64 {
        self.found.account.last_tick().unwrap_or_default()
    }

    /// Every gap in the tick numbers.
    pub fn gaps(&self) -> &[Gap] {
        &self.found.gaps
    }

    /// Scheduled ticks that were not served.
    pub fn overruns(&self) -> u64 {
        self.found.account.overruns()
    }

    /// Records that were lost between loop and file, without those after a cut.
    pub fn lost_records(&self) -> u64 {
        self.found.account.lost_records()
    }

    /// As [`super::Totals::loop_digest`].
    pub fn loop_digest(&self) -> u64 {
        self.found.digest.value()
    }

    /// Streams the ticks, with one chunk at a time in memory.
    pub fn ticks(&self) -> Result<Ticks, RecordingError> {
        Ok(Ticks::of(self.published()?))
    }

    /// Streams ticks and events in the order in which the loop published them.
    pub(super) fn published(&self) -> Result<Stream, RecordingError> {
        let count = self.tick_count() + self.events().len() as u64;
        Ok(Stream::new(&self.path, Walk::new(open(&self.path)?), count))
    }
}

impl RecordingContents {
    fn take(&mut self, part: Part<'_>) -> Result<(), String> {
        match part {
            Part::Message {
                topic: Topic::Timing,
                data,
            } => self.timings.push(decode(data)?),
            Part::Message { topic, data } => {
                self.published(published(topic, data)?)?;
                self.digest.add(topic as u8, data);
            }
            Part::Attachment {
                name,
                media_type,
                data,
            } => {
                self.attachments.push(StoredAttachment {
                    name,
                    media_type,
                    data: data.into(),
                });
            }
            Part::Metadata(m) if m.name == METADATA_RECORD => self.metadata.extend(m.metadata),
            Part::Metadata(_) => {}
        }
        Ok(())
    }

    fn published(&mut self, published: LoopMessage) -> Result<(), String> {
        match published {
            LoopMessage::Event(event) => {
                self.account.event(&event);
                self.events.push(event);
            }
            LoopMessage::Tick(tick) => {
                let refused = |last| format!("tick {} follows tick {last}", tick.tick);
                self.gaps
                    .extend(self.account.tick(&tick).map_err(|e| refused(e.0))?);
            }
        }
        Ok(())
    }
}

fn open(path: &Path) -> Result<File, RecordingError> {
    File::open(path).map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => RecordingError::Missing { path: path.into() },
        _ => RecordingError::Read {
            path: path.into(),
            source,
        },
    })
}

/// The cut at which a walk ended early, or why the file cannot be used.
fn judge(
    path: &Path,
    stop: Stop,
    at_byte: u64,
    found: &RecordingContents,
    salvage: bool,
) -> Result<Cut, RecordingError> {
    let why = match stop {
        Stop::Cut => "the file ends there".into(),
        Stop::Damaged(why) if salvage => why,
        Stop::Damaged(what) => {
            return Err(RecordingError::Damaged {
                path: path.into(),
                at_byte,
                ticks: found.account.ticks(),
                what,
            });
        }
        Stop::NotMcap => return Err(RecordingError::NotMcap { path: path.into() }),
        Stop::Read(source) => {
            return Err(RecordingError::Read {
                path: path.into(),
                source,
            });
        }
    };
    Ok(Cut {
        at_byte,
        of_bytes: path.metadata().map_or(at_byte, |m| m.len()),
        why,
    })
}

/// Refuses a file of another program, and a recording without ticks.
fn require_ticks(
    path: &Path,
    contents: &Contents,
    found: &RecordingContents,
    is_cut: bool,
) -> Result<(), RecordingError> {
    if found.account.ticks() > 0 {
        return Ok(());
    }
    let path = path.to_path_buf();
    let is_cut_at_its_start = is_cut && contents.channels.is_empty();
    if contents.has_loop() || is_cut_at_its_start {
        return Err(RecordingError::Empty { path, is_cut });
    }
    let channels = channels(contents);
    Err(RecordingError::OtherProgram { path, channels })
}

/// The channels as text.
fn channels(contents: &Contents) -> String {
    let channels = contents.channels.values();
    let names: Vec<_> = channels
        .map(|(topic, schema)| format!("{topic} of {schema}"))
        .collect();
    match names.is_empty() {
        true => "it has no channels".into(),
        false => format!("it has {}", names.join(", ")),
    }
}
