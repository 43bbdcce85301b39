//! Copies the intact parts of each recording in a cut-off or damaged file to a complete one.

use std::fs::{File, TryLockError};
use std::path::Path;

use super::losses::{Cut, DamagedRange, MissingTicks};
use super::reader::{Recording, SalvagedParts};
use super::refusal::most_specific;
use super::{CONFIG_ATTACHMENT, Header, RECOVERED, Recorder, RecordingError, Totals};
use bench_base::atomic_file::numbered_names;
use bench_base::locked::{Locked, NotLocked};

/// The result of the recovery of a file.
#[derive(Debug)]
pub struct Recovery {
    /// The first recording in the file.
    pub first: Recovered,
    /// The recordings behind it, in the order of the file.
    pub others: Vec<Recovered>,
    /// The parts of the file without a recording that has ticks.
    pub unused: Vec<DamagedRange>,
}

impl Recovery {
    /// All recordings, in the order of the file.
    pub fn recordings(&self) -> impl Iterator<Item = &Recovered> {
        std::iter::once(&self.first).chain(&self.others)
    }

    /// Whether every byte of the file belongs to a recording that is complete.
    pub fn is_complete(&self) -> bool {
        self.unused.is_empty() && self.recordings().all(Recovered::is_complete)
    }
}

/// A recovered recording.
#[derive(Debug)]
pub struct Recovered {
    /// Where the old recording begins in its file.
    pub from_byte: u64,
    /// Counts of the new recording.
    pub totals: Totals,
    /// The end of the readable part of the old recording; `None` if its data were read to their end.
    pub cut: Option<Cut>,
    /// The other parts of the old recording that could not be used.
    pub damage: Vec<DamagedRange>,
    /// The ticks that are missing because of the damage, without those after a cut.
    pub missing_ticks: Vec<MissingTicks>,
    /// The attachments that are missing because of the damage.
    pub missing_attachments: Vec<String>,
    /// Whether the summary of the old recording was intact. The new one has a new summary, so nothing is lost with it.
    pub had_summary: bool,
    /// Messages that no CRC covers: whether they are altered is not known.
    pub unchecked_messages: u64,
}

impl Recovered {
    /// Whether everything that the loop published is in the new recording, verified by a CRC.
    pub fn is_complete(&self) -> bool {
        self.is_undamaged() && self.totals.lost_records == 0
    }

    /// Whether nothing is missing because of a cut or a damage of the file.
    pub fn is_undamaged(&self) -> bool {
        self.cut.is_none()
            && self.damage.is_empty()
            && self.missing_attachments.is_empty()
            && self.unchecked_messages == 0
    }

    /// The missing ticks whose number is known.
    pub fn missing_tick_count(&self) -> u64 {
        self.missing_ticks.iter().map(|missing| missing.ticks).sum()
    }
}

/// Copies everything in `from` that is intact to the new file `to`: the messages, byte for byte, the configuration, the
/// metadata (with an additional entry `recovered` that describes what is missing) and the attachments. An event `lost` counts the
/// missing messages at their place. `from` is not changed.
///
/// A file may hold several recordings, one after the other. The first one is copied to `to`, and each other one to the first free
/// name of `STEM-2.EXT`, `STEM-3.EXT`, ... beside it.
///
/// # Errors
/// When `from` is still being written or cannot be read, or has no recording with ticks, or `to` exists or cannot be written.
pub fn recover(from: &Path, to: &Path) -> Result<Recovery, RecordingError> {
    let _reading = not_in_use(from)?;
    let mut recovered = Vec::new();
    let (mut unused, mut errors) = (Vec::new(), Vec::new());
    for part in SalvagedParts::of(from)? {
        let part = part?;
        match part.recording {
            Ok(old) if recovered.is_empty() => recovered.push(copy(&old, create(to, &old)?)?),
            Ok(old) => recovered.push(copy(&old, create_beside(to, &old)?)?),
            Err(error) => {
                unused.push(DamagedRange {
                    from_byte: part.from_byte,
                    to_byte: part.to_byte,
                    why: why_unused(&error),
                });
                errors.push(error);
            }
        }
    }
    let mut recovered = recovered.into_iter();
    match recovered.next() {
        Some(first) => Ok(Recovery {
            first,
            others: recovered.collect(),
            unused,
        }),
        None => Err(most_specific(errors, from)),
    }
}

fn why_unused(error: &RecordingError) -> String {
    match error {
        RecordingError::Empty { emptiness, .. } => {
            format!("the recording there has no ticks ({})", emptiness.why())
        }
        RecordingError::OtherProgram { channels, .. } => {
            format!("an MCAP file of another program is there ({channels})")
        }
        _ => "nothing of a recording was found there".into(),
    }
}

fn create(to: &Path, old: &Recording) -> Result<Recorder, RecordingError> {
    Recorder::create(to, &header(old))
}

/// A new file beside `to`, with a number.
fn create_beside(to: &Path, old: &Recording) -> Result<Recorder, RecordingError> {
    for name in numbered_names(to).skip(1) {
        match create(&name, old) {
            Err(RecordingError::Exists { .. }) => {}
            created => return created,
        }
    }
    Err(RecordingError::Exists { path: to.into() })
}

fn copy(old: &Recording, mut new: Recorder) -> Result<Recovered, RecordingError> {
    for published in old.published()? {
        new.record(&published?)?;
    }
    let others = old
        .attachments()
        .iter()
        .filter(|a| a.name != CONFIG_ATTACHMENT);
    let results: Vec<_> = others
        .map(|a| (a.name.as_str(), a.media_type.as_str(), a.data.as_slice()))
        .collect();
    Ok(Recovered {
        from_byte: old.from_byte(),
        totals: new.finish(&results)?,
        cut: old.cut().cloned(),
        damage: old.damage().to_vec(),
        missing_ticks: old.missing_ticks().to_vec(),
        missing_attachments: old.missing_attachments().to_vec(),
        had_summary: old.has_summary(),
        unchecked_messages: old.unchecked_messages(),
    })
}

/// The file, locked against a writer; `None` if it cannot be opened or locked, which reading it reports.
fn not_in_use(path: &Path) -> Result<Option<Locked>, RecordingError> {
    let Ok(file) = File::open(path) else {
        return Ok(None);
    };
    match Locked::shared(file) {
        Ok(locked) => Ok(Some(locked)),
        Err(NotLocked { error, .. }) => match error {
            TryLockError::WouldBlock => Err(RecordingError::InUse { path: path.into() }),
            TryLockError::Error(_) => Ok(None),
        },
    }
}

fn header(old: &Recording) -> Header {
    let mut metadata = old.metadata().clone();
    let losses = losses(old);
    if !losses.is_empty() {
        metadata.insert(RECOVERED.into(), losses.join("; "));
    }
    Header {
        config_toml: old.config_toml().unwrap_or_default().into(),
        period_s: old.period_s().unwrap_or_default(),
        started_ns: old.started_ns().unwrap_or_default(),
        metadata,
    }
}

/// What is missing, in words.
fn losses(old: &Recording) -> Vec<String> {
    let mut losses = Vec::new();
    losses.extend(old.cut().map(|cut| {
        let (at_byte, of_bytes, why) = (cut.at_byte, cut.of_bytes, &cut.why);
        format!("readable up to byte {at_byte} of {of_bytes}: {why}")
    }));
    losses.extend(old.damage().iter().map(DamagedRange::to_string));
    losses.extend(old.missing_ticks().iter().map(MissingTicks::to_string));
    let attachments = old.missing_attachments().iter();
    losses.extend(attachments.map(|name| format!("the attachment {name} is missing")));
    losses
}
