//! Opens recordings, complete or cut off.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use super::attachments::{Preceding, StoredAttachment, attachment, config_toml};
use super::contents::{Contents, Part};
use super::continuity::{Continuity, Gap};
use super::digest::Digest;
use super::error::Emptiness;
use super::losses::{Cut, DamagedRange, MissingTicks};
use super::messages::Timing;
use super::scanner::Scanner;
use super::stream::{Decoded, Decoder, RecordReader, Stream, Ticks};
use super::summary::Summary;
use super::walk::{Stop, Walk};
use super::writer::{PERIOD_S, STARTED_NS};
use super::{CONFIG_ATTACHMENT, METADATA_RECORD, RECOVERED, RecordingError, Topic};
use bench_base::input_file;
use bench_rt::record::{Event, TickRecord};

/// Receives a tick of a recording, and what precedes it.
pub type TickReceiver<'a> = dyn FnMut(&Preceding<'_>, &TickRecord) + 'a;

/// A recording that was read once from start to end. All checks have passed, everything except the ticks is in
/// memory, and the ticks can be streamed any number of times.
#[derive(Debug)]
pub struct Recording {
    path: PathBuf,
    cut: Option<Cut>,
    found: RecordingContents,
    unchecked_messages: u64,
    /// `None` if the file was not opened for salvage.
    salvage: Option<Salvage>,
}

/// What is missing in a file that was opened for salvage.
#[derive(Debug)]
struct Salvage {
    damage: Vec<DamagedRange>,
    missing_attachments: Vec<String>,
    has_summary: bool,
}

/// The contents of the file, without the ticks.
#[derive(Debug, Default)]
struct RecordingContents {
    metadata: BTreeMap<String, String>,
    attachments: Vec<StoredAttachment>,
    events: Vec<Event>,
    timings: Vec<Timing>,
    gaps: Vec<Gap>,
    missing_ticks: Vec<MissingTicks>,
    /// Messages on `/loop` that are missing since the last tick.
    missing_since_tick: u64,
    last_tick: Option<TickRecord>,
    period_by_ticks_ns: Option<u64>,
    decoder: Decoder,
    digest: Digest,
}

impl Recording {
    /// Opens a recording. A file that ends early is read up to its end, see [`Recording::truncated`]; a damaged file is refused.
    pub fn open(path: &Path) -> Result<Recording, RecordingError> {
        Recording::open_with(path, &mut |_, _| {})
    }

    /// As [`Recording::open`]. `on_tick` receives every tick in its order, before it is known whether the rest of the file is intact.
    pub fn open_with(
        path: &Path,
        on_tick: &mut TickReceiver<'_>,
    ) -> Result<Recording, RecordingError> {
        let file = open(path)?;
        refuse_other_program(&file, path)?;
        let mut walk = Walk::new(file);
        let mut found = RecordingContents::default();
        let stop = read_to_end(&mut walk, &mut found, on_tick).err();
        let cut = stop.map(|stop| judge(path, stop, walk.offset, &found));
        let cut = cut.transpose()?;
        let emptiness = match cut {
            Some(_) => Emptiness::CutOff,
            None => Emptiness::Complete,
        };
        require_ticks(path, &walk.contents, &found, emptiness)?;
        Ok(Recording {
            path: path.into(),
            cut,
            found,
            unchecked_messages: walk.contents.unchecked_messages,
            salvage: None,
        })
    }

    /// As [`Recording::open`], but passes over each damage to the next intact record. [`Recording::damage`] and
    /// [`Recording::missing_ticks`] tell what is missing; an [`EventKind::Lost`](bench_rt::record::EventKind::Lost) is among
    /// the events where messages are missing.
    pub fn salvage(path: &Path) -> Result<Recording, RecordingError> {
        let failed = |source| RecordingError::Read {
            path: path.into(),
            source,
        };
        let mut scanner = Scanner::new(open(path)?).map_err(failed)?;
        let mut found = RecordingContents::default();
        while scanner
            .step(&mut |part| found.take(part, &mut |_, _| {}))
            .map_err(failed)?
        {}
        found.end();
        if found.account().ticks() == 0 && !scanner.has_magic {
            return Err(RecordingError::NotMcap { path: path.into() });
        }
        Recording::salvaged(path, scanner, found)
    }

    /// The recording of a scanned file.
    fn salvaged(
        path: &Path,
        scanner: Scanner,
        found: RecordingContents,
    ) -> Result<Recording, RecordingError> {
        let emptiness = match (&scanner.cut, scanner.damage.as_slice()) {
            (Some(_), []) => Emptiness::CutOff,
            (None, []) => Emptiness::Complete,
            (_, [..]) => Emptiness::Damaged,
        };
        require_ticks(path, &scanner.contents, &found, emptiness)?;
        Ok(Recording {
            path: path.into(),
            unchecked_messages: scanner.contents.unchecked_messages,
            salvage: Some(Salvage {
                missing_attachments: missing_attachments(&found, scanner.summary.as_ref()),
                has_summary: scanner.summary.is_some(),
                damage: scanner.damage,
            }),
            cut: scanner.cut,
            found,
        })
    }

    /// The parts of a salvaged file that could not be used, without that after a cut.
    pub fn damage(&self) -> &[DamagedRange] {
        self.salvage.as_ref().map_or(&[], |s| &s.damage)
    }

    /// The attachments that a salvaged file lacks.
    pub fn missing_attachments(&self) -> &[String] {
        self.salvage
            .as_ref()
            .map_or(&[], |s| &s.missing_attachments)
    }

    /// Whether a salvaged file has an intact summary.
    pub(super) fn has_summary(&self) -> bool {
        self.salvage.as_ref().is_none_or(|s| s.has_summary)
    }

    /// The ticks that are missing in a salvaged file, without those after a cut whose number is not known.
    pub fn missing_ticks(&self) -> &[MissingTicks] {
        &self.found.missing_ticks
    }

    /// Messages that no CRC covers, so that an alteration of them is not detected: those of a file without chunks and without a
    /// CRC of its data section, which other programs write.
    pub fn unchecked_messages(&self) -> u64 {
        self.unchecked_messages
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether the recording was not finished.
    pub fn truncated(&self) -> bool {
        self.cut.is_some()
    }

    /// Whether it was recovered from a file of which something was missing.
    pub fn was_damaged(&self) -> bool {
        self.found.metadata.contains_key(RECOVERED)
    }

    /// The end of the readable part, if the recording was not finished.
    pub fn cut(&self) -> Option<&Cut> {
        self.cut.as_ref()
    }

    /// The effective configuration of the run; `None` also if it is empty, because it could not be recovered.
    pub fn config_toml(&self) -> Option<&str> {
        config_toml(self.attachments())
    }

    /// Version of the program, host, scheduling, `period_ns` and other properties of the run.
    pub fn metadata(&self) -> &BTreeMap<String, String> {
        &self.found.metadata
    }

    /// Period of the loop, if it is recorded.
    pub fn period_ns(&self) -> Option<u64> {
        self.found.metadata.get("period_ns")?.parse().ok()
    }

    /// Period of the loop in seconds. In recordings of older versions, and in those without metadata, it is known in whole
    /// nanoseconds only.
    pub fn period_s(&self) -> Option<f64> {
        let stored = self.found.metadata.get(PERIOD_S);
        let period_ns = || self.period_ns().or(self.period_by_ticks_ns());
        let stored: Option<f64> = stored.and_then(|text| text.parse().ok());
        let valid = stored.filter(|period_s| period_s.is_finite() && *period_s >= 0.0);
        valid.or_else(|| Some(period_ns()? as f64 * 1e-9))
    }

    /// Log time of the start of the loop as known before its first tick, in nanoseconds since 1970; `None` in recordings of older
    /// versions, whose log times begin with 0.
    pub fn started_ns(&self) -> Option<u64> {
        self.found.metadata.get(STARTED_NS)?.parse().ok()
    }

    /// The time between the first two consecutive ticks.
    pub(super) fn period_by_ticks_ns(&self) -> Option<u64> {
        self.found.period_by_ticks_ns
    }

    /// All attachments, in the order of the file.
    pub fn attachments(&self) -> &[StoredAttachment] {
        &self.found.attachments
    }

    /// The first attachment of that name.
    pub fn attachment(&self, name: &str) -> Option<&StoredAttachment> {
        attachment(self.attachments(), name)
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
        self.found.account().ticks()
    }

    /// Number of the first tick.
    pub fn first_tick(&self) -> u64 {
        self.found.account().first_tick().unwrap_or_default()
    }

    /// Number of the last tick.
    pub fn last_tick(&self) -> u64 {
        self.found.account().last_tick().unwrap_or_default()
    }

    /// Every gap in the tick numbers.
    pub fn gaps(&self) -> &[Gap] {
        &self.found.gaps
    }

    /// Scheduled ticks that were not served.
    pub fn overruns(&self) -> u64 {
        self.found.account().overruns()
    }

    /// Records that were lost between loop and file, without those after a cut.
    pub fn lost_records(&self) -> u64 {
        self.found.account().lost_records()
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
        Ok(Stream::new(&self.path, self.reader()?, count))
    }

    fn reader(&self) -> Result<RecordReader, RecordingError> {
        let file = open(&self.path)?;
        if self.salvage.is_none() {
            return Ok(RecordReader::Walk(Box::new(Walk::new(file))));
        }
        let scanner = Scanner::new(file).map_err(|source| RecordingError::Read {
            path: self.path.clone(),
            source,
        })?;
        Ok(RecordReader::Scanner(Box::new(scanner)))
    }
}

impl RecordingContents {
    fn account(&self) -> &Continuity {
        &self.decoder.account
    }

    fn take(&mut self, part: Part<'_>, on_tick: &mut TickReceiver<'_>) -> Result<(), String> {
        match self.decoder.decode(&part)? {
            Some(Decoded::Tick(tick, gap)) => {
                self.tick(&tick, gap);
                on_tick(&self.preceding(), &tick);
            }
            Some(Decoded::Event(event)) => self.events.push(event),
            Some(Decoded::Timing(timing)) => self.timings.push(timing),
            None => {}
        }
        self.take_undecoded(part);
        Ok(())
    }

    fn preceding(&self) -> Preceding<'_> {
        Preceding {
            metadata: &self.metadata,
            attachments: &self.attachments,
        }
    }

    fn take_undecoded(&mut self, part: Part<'_>) {
        match part {
            Part::Message {
                topic: topic @ (Topic::Loop | Topic::Event),
                data,
            } => self.digest.add(topic as u8, data),
            Part::Missing {
                topic: Topic::Loop,
                messages,
            } => self.missing_since_tick += messages,
            Part::Message { .. } | Part::Missing { .. } => {}
            Part::Attachment {
                name,
                media_type,
                data,
            } => self.attachments.push(StoredAttachment {
                name,
                media_type,
                data: data.into(),
            }),
            Part::Metadata(m) if m.name == METADATA_RECORD => self.metadata.extend(m.metadata),
            Part::Metadata(_) => {}
        }
    }

    fn tick(&mut self, tick: &TickRecord, gap: Option<Gap>) {
        self.gaps.extend(gap);
        if self.missing_since_tick > 0 {
            let first = match gap {
                Some(gap) => gap.after_tick + 1,
                None => tick.tick.saturating_sub(self.missing_since_tick),
            };
            self.add_missing(first, tick.tick.saturating_sub(1));
        }
        if let Some(last) = &self.last_tick
            && last.tick + 1 == tick.tick
            && self.period_by_ticks_ns.is_none()
        {
            self.period_by_ticks_ns = tick.scheduled_ns.checked_sub(last.scheduled_ns);
        }
        self.last_tick = Some(*tick);
    }

    fn add_missing(&mut self, first_tick: u64, last_tick: u64) {
        self.missing_ticks.push(MissingTicks {
            first_tick,
            last_tick,
            ticks: std::mem::take(&mut self.missing_since_tick),
        });
    }

    /// The messages that are missing after the last tick.
    fn end(&mut self) {
        if self.missing_since_tick > 0 {
            let first = self.last_tick.map_or(0, |tick| tick.tick.saturating_add(1));
            let last = first.saturating_add(self.missing_since_tick - 1);
            self.add_missing(first, last);
        }
    }
}

/// The attachments that the summary names, and the configuration, as far as they were not found.
fn missing_attachments(found: &RecordingContents, summary: Option<&Summary>) -> Vec<String> {
    let mut missing: Vec<String> = summary.map_or(Vec::new(), |s| s.attachments.clone());
    if !missing.iter().any(|name| name == CONFIG_ATTACHMENT) {
        missing.push(CONFIG_ATTACHMENT.into());
    }
    missing.retain(|name| !found.attachments.iter().any(|a| a.name == *name));
    missing
}

/// Refuses a file whose summary names channels, but not that with the ticks.
fn refuse_other_program(file: &File, path: &Path) -> Result<(), RecordingError> {
    let bytes = file.metadata().map_or(0, |m| m.len());
    match Summary::read(file, bytes) {
        Some(Summary { definitions, .. })
            if !definitions.channels.is_empty() && !definitions.has_loop() =>
        {
            Err(RecordingError::OtherProgram {
                path: path.into(),
                channels: channels(&definitions),
            })
        }
        _ => Ok(()),
    }
}

fn open(path: &Path) -> Result<File, RecordingError> {
    input_file::open(path).map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => RecordingError::Missing { path: path.into() },
        _ => RecordingError::Read {
            path: path.into(),
            source,
        },
    })
}

/// Walks to the end of the file, or to where it cannot be read.
fn read_to_end(
    walk: &mut Walk,
    found: &mut RecordingContents,
    on_tick: &mut TickReceiver<'_>,
) -> Result<(), Stop> {
    while walk.step(&mut |part| found.take(part, on_tick))? {}
    Ok(())
}

/// The cut at which a walk ended early, or why the file cannot be used.
fn judge(
    path: &Path,
    stop: Stop,
    at_byte: u64,
    found: &RecordingContents,
) -> Result<Cut, RecordingError> {
    let why = match stop {
        Stop::Cut => "the file ends there".into(),
        Stop::Damaged(what) => {
            return Err(RecordingError::Damaged {
                path: path.into(),
                at_byte,
                ticks: found.account().ticks(),
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
    emptiness: Emptiness,
) -> Result<(), RecordingError> {
    if found.account().ticks() > 0 {
        return Ok(());
    }
    let path = path.to_path_buf();
    let may_be_own = contents.channels.is_empty() && emptiness != Emptiness::Complete;
    if contents.has_loop() || may_be_own {
        return Err(RecordingError::Empty { path, emptiness });
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
    if names.is_empty() {
        "it has no channels".into()
    } else {
        format!("it has {}", names.join(", "))
    }
}
