//! Opens recordings, complete or cut off, and says what they hold.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;

use super::continuity::{Continuity, Gap};
use super::digest::Digest;
use super::messages::Timing;
use super::stream::{Stream, Ticks, decode, published};
use super::walk::{Contents, Part, Stop, Walk};
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

/// Where a recording that is not complete stops being readable.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Cut {
    /// Number of bytes that could be read.
    pub at_byte: u64,
    /// Size of the file.
    pub of_bytes: u64,
    /// The reason.
    pub why: String,
}

/// A recording that was gone through once from end to end: every check has passed, everything but the ticks is in
/// memory, the ticks can be streamed as often as wanted.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    cut: Option<Cut>,
    found: Found,
}

/// What going through the file has shown.
#[derive(Debug, Default)]
struct Found {
    metadata: BTreeMap<String, String>,
    attachments: Vec<StoredAttachment>,
    events: Vec<Event>,
    timings: Vec<Timing>,
    gaps: Vec<Gap>,
    account: Continuity,
    digest: Digest,
}

impl Recording {
    /// Opens a recording. A file that ends early is read up to there, see [`Recording::truncated`]; one that was altered
    /// is refused.
    pub fn open(path: &Path) -> Result<Recording, RecordingError> {
        Recording::read(path, false)
    }

    /// As [`Recording::open`], but what stands before the first damage is handed out as of a recording cut off there.
    pub fn salvage(path: &Path) -> Result<Recording, RecordingError> {
        Recording::read(path, true)
    }

    fn read(path: &Path, salvage: bool) -> Result<Recording, RecordingError> {
        let mut walk = Walk::new(open(path)?);
        let mut found = Found::default();
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
        refuse_without_ticks(path, &walk.contents, &found, cut.is_some())?;
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

    /// Whether the file ends before its recording was finished.
    pub fn truncated(&self) -> bool {
        self.cut.is_some()
    }

    /// Where and why the file stops being readable, of a truncated one.
    pub fn cut(&self) -> Option<&Cut> {
        self.cut.as_ref()
    }

    /// The effective configuration of the run, as it was attached at its start.
    pub fn config_toml(&self) -> Option<&str> {
        self.attachment(CONFIG_ATTACHMENT)
            .and_then(|a| std::str::from_utf8(&a.data).ok())
    }

    /// Program version, host, scheduling, `period_ns` and what else the run said of itself.
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.found.metadata
    }

    /// Period of the loop, if the recording says so.
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

    /// How many ticks there are.
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

    /// Scheduled ticks that passed unserved.
    pub fn overruns(&self) -> u64 {
        self.found.account.overruns()
    }

    /// Records lost on the way from the loop into the file (not those behind a cut).
    pub fn lost_records(&self) -> u64 {
        self.found.account.lost_records()
    }

    /// As [`super::Totals::loop_digest`].
    pub fn loop_digest(&self) -> u64 {
        self.found.digest.value()
    }

    /// Streams the ticks; no more than a chunk of them is in memory.
    pub fn ticks(&self) -> Result<Ticks, RecordingError> {
        Ok(Ticks::of(self.published()?))
    }

    /// Streams ticks and events in the order in which the loop published them.
    pub(super) fn published(&self) -> Result<Stream, RecordingError> {
        let count = self.tick_count() + self.events().len() as u64;
        Ok(Stream::new(&self.path, Walk::new(open(&self.path)?), count))
    }
}

impl Found {
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

/// Whether a walk that stopped early still leaves a recording to work with.
fn judge(
    path: &Path,
    stop: Stop,
    at_byte: u64,
    found: &Found,
    salvage: bool,
) -> Result<Cut, RecordingError> {
    let path = path.to_path_buf();
    let of_bytes = path.metadata().map_or(at_byte, |m| m.len());
    match stop {
        Stop::Cut => Ok(Cut {
            at_byte,
            of_bytes,
            why: "the file ends there".into(),
        }),
        Stop::Damaged(why) if salvage => Ok(Cut {
            at_byte,
            of_bytes,
            why,
        }),
        Stop::Damaged(what) => Err(RecordingError::Damaged {
            path,
            at_byte,
            ticks: found.account.ticks(),
            what,
        }),
        Stop::NotMcap => Err(RecordingError::NotMcap { path }),
        Stop::Read(source) => Err(RecordingError::Read { path, source }),
    }
}

fn refuse_without_ticks(
    path: &Path,
    contents: &Contents,
    found: &Found,
    cut: bool,
) -> Result<(), RecordingError> {
    if found.account.ticks() > 0 {
        return Ok(());
    }
    let path = path.to_path_buf();
    if contents.has_loop() || (cut && contents.channels.is_empty()) {
        let state = if cut {
            "it was cut off before its first half second was written"
        } else {
            "it is complete"
        };
        return Err(RecordingError::Empty { path, state });
    }
    let names: Vec<_> = contents
        .channels
        .values()
        .map(|(topic, schema)| format!("{topic} of {schema}"))
        .collect();
    let found = if names.is_empty() {
        "it has no channels".into()
    } else {
        format!("it has {}", names.join(", "))
    };
    Err(RecordingError::Foreign { path, found })
}
