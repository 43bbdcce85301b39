//! Writes one run of the loop into an MCAP file.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use mcap::records::MessageHeader;
use mcap::write::{Metadata, NoSeek};
use mcap::{Attachment, Compression, McapError, McapResult, WriteOptions};
use prost::Message;
use serde::{Deserialize, Serialize};

use super::continuity::Continuity;
use super::digest::Digest;
use super::event_message::of_override;
use super::log_time::LogTime;
use super::messages;
use super::schema::descriptor_set;
use super::sync::{Syncable, Syncing};
use super::timing::{Quantiles, Tally};
use super::{CONFIG_ATTACHMENT, METADATA_RECORD, RecordingError, Topic};
use bench_base::locked::Locked;
use bench_rt::clock::scheduled_ns;
use bench_rt::record::{Event, EventKind, LoopMessage, TickRecord};

/// A chunk is closed and written at every multiple of this scheduled time, at any rate: if the process is killed, at most
/// 0.2 s is lost, the chunk and what is on the way to it. At 5 kHz a chunk holds 500 ticks, about 52 kB before compression.
const CHUNK_NS: u64 = 100_000_000;

/// A chunk is also closed at this size, so that its size is limited at any rate and with any number of events.
const CHUNK_BYTES: u64 = 1 << 20;

/// Level of the compression. Of a chirp of 120 s at 5 kHz, level 1 leaves 46.4, level 2 41.9 and level 3 39.1 bytes a tick, beside 16 bytes
/// a tick of message index that are not compressed. Level 3 takes more processor time, 5 and 6 leave as much as 3.
const ZSTD_LEVEL: u32 = 2;

/// Keys of the metadata: period of the loop, and log time of its start.
pub(super) const PERIOD_S: &str = "period_s";
pub(super) const STARTED_NS: &str = "started_ns";

/// Properties of a run that are known before its first tick. They are written before [`Recorder::create`] returns, so
/// that even a recording that is cut off later contains them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Header {
    /// The whole effective configuration.
    pub config_toml: String,
    /// Period of the loop in seconds, which gives the time of an event.
    pub period_s: f64,
    /// Wall clock at the start of the loop in nanoseconds since 1970. In real time the loop publishes it more exactly.
    pub started_ns: u64,
    /// Version of the program, host, scheduling of the loop, and begin of the run.
    pub metadata: BTreeMap<String, String>,
}

/// Counts and timing of a recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Totals {
    /// The file.
    pub path: PathBuf,
    /// Recorded ticks.
    pub ticks: u64,
    /// Recorded events.
    pub events: u64,
    /// Number of the first tick, if there is one.
    pub first_tick: Option<u64>,
    /// Number of the last tick, if there is one.
    pub last_tick: Option<u64>,
    /// Scheduled ticks that were not served.
    pub overruns: u64,
    /// Lost records: the larger of the number that the loop reported and the number by the gaps in the tick numbers.
    pub lost_records: u64,
    /// Time at which the loop woke up minus time at which the tick was due; a tick that replaces missed ones was due with the
    /// first of them.
    pub lateness: Quantiles,
    /// Time from waking up to the written command.
    pub compute: Quantiles,
    /// Equal for two runs whose messages on `/loop` and `/event` are equal bit for bit. Two different runs have the same digest
    /// with a probability of 2^-64.
    pub loop_digest: u64,
}

/// An open recording.
pub struct Recorder {
    path: PathBuf,
    mcap: mcap::Writer<NoSeek<BufWriter<Box<dyn Write + Send>>>>,
    /// Numbers of the channels, in the order of [`Topic::ALL`].
    channels: [u16; 3],
    /// Messages written on each.
    written: [u64; 3],
    period_s: f64,
    log_time: LogTime,
    /// The log time of the last message.
    last_log_ns: u64,
    syncing: Option<Syncing>,
    /// Shows other processes that the file is being written; `None` if it is not a file.
    in_use: Option<Locked>,
    chunk_ends_ns: u64,
    encoded: Vec<u8>,
    account: Continuity,
    tally: Tally,
    digest: Digest,
}

impl Recorder {
    /// Creates the file and writes `header` to it. An existing file is never changed. Until the recorder is dropped, the file is locked, so
    /// that [`recover`](super::recover()) refuses it.
    pub fn create(path: &Path, header: &Header) -> Result<Recorder, RecordingError> {
        let file = File::create_new(path).map_err(|source| match source.kind() {
            io::ErrorKind::AlreadyExists => RecordingError::Exists { path: path.into() },
            _ => RecordingError::Create {
                path: path.into(),
                source,
            },
        })?;
        let not_started = |source| RecordingError::NotStarted {
            path: path.into(),
            source,
        };
        let same_file = file.try_clone().map_err(not_started)?;
        let in_use = mark_in_use(path);
        let mut recorder = Recorder::over(Box::new(file), path, header)?;
        recorder.in_use = in_use;
        recorder.synced(Box::new(same_file)).map_err(not_started)
    }

    /// The recorder with a thread that syncs `file` once per second.
    pub fn synced(mut self, file: Box<dyn Syncable>) -> io::Result<Recorder> {
        self.syncing = Some(Syncing::start(file)?);
        Ok(self)
    }

    /// Records to any writer; `path` is its name in messages.
    pub fn over(
        out: Box<dyn Write + Send>,
        path: &Path,
        header: &Header,
    ) -> Result<Recorder, RecordingError> {
        let failed = |source| RecordingError::Write {
            path: path.into(),
            ticks: 0,
            source,
        };
        let mut mcap = options()
            .create(NoSeek::new(BufWriter::new(out)))
            .map_err(failed)?;
        let channels = write_head(&mut mcap, header).map_err(failed)?;
        Ok(Recorder {
            path: path.into(),
            mcap,
            channels,
            written: [0; 3],
            period_s: header.period_s,
            log_time: LogTime::new(header.started_ns),
            last_log_ns: header.started_ns,
            syncing: None,
            in_use: None,
            chunk_ends_ns: CHUNK_NS,
            encoded: Vec::new(),
            account: Continuity::default(),
            tally: Tally::new(period_ns(header)),
            digest: Digest::default(),
        })
    }

    /// Writes a message of the loop. After an error the recording is cut off, and nothing more can be written.
    pub fn record(&mut self, published: &LoopMessage) -> Result<(), RecordingError> {
        match published {
            LoopMessage::Tick(tick) => self.tick(tick),
            LoopMessage::Event(event) => self.event(event),
        }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Adds a file to the recording.
    pub fn attach(
        &mut self,
        name: &str,
        media_type: &str,
        data: &[u8],
    ) -> Result<(), RecordingError> {
        let file = (name, media_type, data);
        let written = attach(&mut self.mcap, self.last_log_ns, file);
        written.map_err(|source| self.failed(source))
    }

    /// Writes everything that is still in memory and returns the counts. The file is then readable, so that results can be
    /// computed from it before they are added.
    pub fn complete(&mut self) -> Result<Totals, RecordingError> {
        self.close_second()?;
        self.mcap.flush().map_err(|source| self.failed(source))?;
        Ok(self.totals())
    }

    /// Adds results as (name, media type, content), completes the file and returns the counts.
    pub fn finish(mut self, attachments: &[(&str, &str, &[u8])]) -> Result<Totals, RecordingError> {
        self.close_second()?;
        let written = self.write_end(attachments);
        written.map_err(|source| self.failed(source))?;
        let synced = self.syncing.take().map_or(Ok(()), Syncing::finish);
        synced.map_err(|source| self.failed(McapError::Io(source)))?;
        Ok(self.totals())
    }

    /// Ticks recorded so far.
    pub fn ticks(&self) -> u64 {
        self.account.ticks()
    }

    /// Writes the event that an operator closes the loop without a valid certificate, before the first tick.
    pub fn note_override(&mut self, reason: &str) -> Result<(), RecordingError> {
        self.write(Topic::Event, 0, &of_override(reason))
    }

    fn tick(&mut self, tick: &TickRecord) -> Result<(), RecordingError> {
        self.check_synced()?;
        if self.tally.is_over(tick) {
            self.close_second()?;
        }
        self.close_chunk_if_due(tick.scheduled_ns)?;
        let order = |after| RecordingError::Order {
            path: self.path.clone(),
            tick: tick.tick,
            after,
        };
        self.account.tick(tick).map_err(|e| order(e.0))?;
        self.tally.add(tick);
        self.write(Topic::Loop, tick.scheduled_ns, &messages::Loop::from(tick))
    }

    fn event(&mut self, event: &Event) -> Result<(), RecordingError> {
        self.account.event(event);
        if let EventKind::Clock(times) = &event.kind {
            self.log_time.follow(times);
        }
        let loop_ns = scheduled_ns(event.tick, self.period_s);
        self.write(Topic::Event, loop_ns, &messages::Event::from(event))
    }

    /// Fails if the file could not be synced.
    fn check_synced(&mut self) -> Result<(), RecordingError> {
        let Some(syncing) = self.syncing.take_if(|syncing| syncing.has_failed()) else {
            return Ok(());
        };
        let failed = syncing.finish();
        failed.map_err(|source| self.failed(McapError::Io(source)))
    }

    fn close_second(&mut self) -> Result<(), RecordingError> {
        match self.tally.close(&self.account) {
            Some((last_ns, timing)) => self.write(Topic::Timing, last_ns, &timing),
            None => Ok(()),
        }
    }

    fn close_chunk_if_due(&mut self, scheduled_ns: u64) -> Result<(), RecordingError> {
        if scheduled_ns < self.chunk_ends_ns {
            return Ok(());
        }
        self.chunk_ends_ns = (scheduled_ns / CHUNK_NS + 1).saturating_mul(CHUNK_NS);
        self.mcap.flush().map_err(|source| self.failed(source))
    }

    fn write(
        &mut self,
        topic: Topic,
        loop_ns: u64,
        message: &impl Message,
    ) -> Result<(), RecordingError> {
        self.encoded.clear();
        // Like `encode`, without the check of the capacity: a Vec grows.
        message.encode_raw(&mut self.encoded);
        self.last_log_ns = self.log_time.at(loop_ns);
        let header = self.next_header(topic);
        self.mcap
            .write_to_known_channel(&header, &self.encoded)
            .map_err(|source| self.failed(source))?;
        if topic != Topic::Timing {
            self.digest.add(topic as u8, &self.encoded);
        }
        Ok(())
    }

    /// Messages of a channel are numbered without a gap, so that a missing chunk is detected.
    fn next_header(&mut self, topic: Topic) -> MessageHeader {
        let count = &mut self.written[topic as usize];
        let sequence = *count as u32;
        *count += 1;
        MessageHeader {
            channel_id: self.channels[topic as usize],
            sequence,
            log_time: self.last_log_ns,
            publish_time: self.last_log_ns,
        }
    }

    fn write_end(&mut self, attachments: &[(&str, &str, &[u8])]) -> McapResult<()> {
        for file in attachments {
            attach(&mut self.mcap, self.last_log_ns, *file)?;
        }
        self.mcap.finish().map(|_| ())
    }

    fn totals(&self) -> Totals {
        let (lateness, compute) = self.tally.totals();
        Totals {
            path: self.path.clone(),
            ticks: self.account.ticks(),
            events: self.written[Topic::Event as usize],
            first_tick: self.account.first_tick(),
            last_tick: self.account.last_tick(),
            overruns: self.account.overruns(),
            lost_records: self.account.lost_records(),
            lateness,
            compute,
            loop_digest: self.digest.value(),
        }
    }

    fn failed(&self, source: McapError) -> RecordingError {
        RecordingError::Write {
            path: self.path.clone(),
            ticks: self.account.ticks(),
            source,
        }
    }
}

/// Locks a file that is being written (the kernel releases the lock when the process ends). The lock has a descriptor of its own, so
/// that it ends with the recorder and not with the thread that syncs. A file system without locks is no reason not to record.
fn mark_in_use(path: &Path) -> Option<Locked> {
    let file = File::open(path).ok()?;
    Locked::exclusive(file).ok()
}

/// Chunks are completed in memory and appended to the file without seeking, so that only the last chunk of a cut file can be
/// incomplete.
fn options() -> WriteOptions {
    WriteOptions::new()
        .compression(Some(Compression::Zstd))
        .compression_level(ZSTD_LEVEL)
        .compression_threads(0)
        .chunk_size(Some(CHUNK_BYTES))
        .disable_seeking(true)
        .library(concat!("bench ", env!("CARGO_PKG_VERSION")))
}

fn write_head<W: Write + io::Seek>(
    mcap: &mut mcap::Writer<W>,
    header: &Header,
) -> McapResult<[u16; 3]> {
    let mut metadata = header.metadata.clone();
    metadata.insert("period_ns".into(), period_ns(header).to_string());
    metadata.insert(PERIOD_S.into(), header.period_s.to_string());
    metadata.insert(STARTED_NS.into(), header.started_ns.to_string());
    mcap.write_metadata(&Metadata {
        name: METADATA_RECORD.into(),
        metadata,
    })?;
    let config = header.config_toml.as_bytes();
    let file = (CONFIG_ATTACHMENT, "application/toml", config);
    attach(mcap, header.started_ns, file)?;
    let schema = descriptor_set();
    let mut channels = [0; 3];
    for topic in Topic::ALL {
        let id = mcap.add_schema(topic.schema_name(), "protobuf", &schema)?;
        channels[topic as usize] =
            mcap.add_channel(id, topic.name(), "protobuf", &BTreeMap::new())?;
    }
    mcap.flush()?;
    Ok(channels)
}

/// The period in whole nanoseconds.
fn period_ns(header: &Header) -> u64 {
    scheduled_ns(1, header.period_s)
}

/// Attaches a file, given as name, media type and content.
fn attach<W: Write + io::Seek>(
    mcap: &mut mcap::Writer<W>,
    log_time: u64,
    (name, media_type, data): (&str, &str, &[u8]),
) -> McapResult<()> {
    mcap.attach(&Attachment {
        log_time,
        create_time: log_time,
        name: name.into(),
        media_type: media_type.into(),
        data: Cow::Borrowed(data),
    })
}
