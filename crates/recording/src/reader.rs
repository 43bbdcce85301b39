//! Opens recordings, complete or cut off.

use std::collections::BTreeMap;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use super::attachments::{StoredAttachment, attachment, config_toml};
use super::boundary::end_of_recording;
use super::continuity::Gap;
use super::error::Emptiness;
use super::file_range::{FileRange, RecordingEnd};
use super::losses::{Cut, DamagedRange, MissingTicks};
use super::messages::Timing;
use super::recording_contents::{RecordingContents, TickReceiver};
use super::refusal::{judge, most_specific, refuse_other_program, require_ticks};
use super::scanner::Scanner;
use super::stream::{RecordReader, Stream, Ticks};
use super::summary::Summary;
use super::walk::{Stop, Walk};
use super::writer::{PERIOD_S, STARTED_NS};
use super::{CONFIG_ATTACHMENT, RECOVERED, RecordingError};
use bench_base::input_file;
use bench_rt::record::Event;

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
    /// The part of the file with the recording.
    from_byte: u64,
    end: RecordingEnd,
    damage: Vec<DamagedRange>,
    missing_attachments: Vec<String>,
    has_summary: bool,
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
        let whole = FileRange::to_end(file, 0).map_err(|source| read_error(path, source))?;
        refuse_other_program(&whole, path)?;
        let mut walk = Walk::new(open(path)?);
        let mut found = RecordingContents::default();
        let stop = read_to_end(&mut walk, &mut found, on_tick).err();
        let cut = stop.map(|stop| judge(path, &whole, stop, walk.offset, &found));
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
    /// the events where messages are missing. Of a file with several recordings, it is the first one with ticks.
    pub fn salvage(path: &Path) -> Result<Recording, RecordingError> {
        let mut errors = Vec::new();
        for part in SalvagedParts::of(path)? {
            match part?.recording {
                Ok(recording) => return Ok(recording),
                Err(error) => errors.push(error),
            }
        }
        Err(most_specific(errors, path))
    }

    /// Where a salvaged recording begins in its file.
    pub fn from_byte(&self) -> u64 {
        self.salvage.as_ref().map_or(0, |s| s.from_byte)
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
        let Some(salvage) = &self.salvage else {
            return Ok(RecordReader::Walk(Box::new(Walk::new(file))));
        };
        let part = FileRange::to_end(file, salvage.from_byte);
        let scanner = part.and_then(|part| Scanner::new(part.up_to(salvage.end)));
        let scanner = scanner.map_err(|source| read_error(&self.path, source))?;
        Ok(RecordReader::Scanner(Box::new(scanner)))
    }
}

/// The parts of a damaged file, one after the other: each is one recording, or has none.
pub(super) struct SalvagedParts {
    path: PathBuf,
    /// Start of the next part.
    next: u64,
    file_bytes: u64,
}

/// A part of a damaged file.
pub(super) struct SalvagedPart {
    pub(super) from_byte: u64,
    pub(super) to_byte: u64,
    /// The recording, or why the part has none.
    pub(super) recording: Result<Recording, RecordingError>,
}

impl SalvagedParts {
    pub(super) fn of(path: &Path) -> Result<SalvagedParts, RecordingError> {
        let metadata = open(path)?.metadata();
        Ok(SalvagedParts {
            path: path.into(),
            next: 0,
            file_bytes: metadata.map_err(|source| read_error(path, source))?.len(),
        })
    }

    fn part(&self) -> Result<SalvagedPart, RecordingError> {
        let failed = |source| read_error(&self.path, source);
        let rest = FileRange::to_end(open(&self.path)?, self.next).map_err(failed)?;
        let end = end_of_recording(&rest).map_err(failed)?;
        let mut scanner = Scanner::new(rest.up_to(end)).map_err(failed)?;
        let mut found = RecordingContents::default();
        while scanner
            .step(&mut |part| found.take(part, &mut |_, _| {}))
            .map_err(failed)?
        {}
        found.end();
        let to_byte = self.next + end.bytes;
        Ok(SalvagedPart {
            from_byte: self.next,
            to_byte: scanner.ends_before_another.unwrap_or(to_byte),
            recording: salvaged(&self.path, end, scanner, found),
        })
    }
}

impl Iterator for SalvagedParts {
    type Item = Result<SalvagedPart, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.next >= self.file_bytes {
            return None;
        }
        let part = self.part();
        let end = part.as_ref().map_or(self.file_bytes, |part| part.to_byte);
        self.next = end.max(self.next + 1);
        Some(part)
    }
}

/// The recording in a scanned part of a file.
fn salvaged(
    path: &Path,
    end: RecordingEnd,
    scanner: Scanner,
    found: RecordingContents,
) -> Result<Recording, RecordingError> {
    if found.account().ticks() == 0 && !scanner.has_magic {
        return Err(RecordingError::NotMcap { path: path.into() });
    }
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
            from_byte: scanner.range.from_byte,
            end,
            missing_attachments: missing_attachments(&found, scanner.summary.as_ref()),
            has_summary: scanner.summary.is_some(),
            damage: scanner.damage,
        }),
        cut: scanner.cut,
        found,
    })
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

fn open(path: &Path) -> Result<File, RecordingError> {
    input_file::open(path).map_err(|source| match source.kind() {
        io::ErrorKind::NotFound => RecordingError::Missing { path: path.into() },
        _ => read_error(path, source),
    })
}

fn read_error(path: &Path, source: io::Error) -> RecordingError {
    RecordingError::Read {
        path: path.into(),
        source,
    }
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
