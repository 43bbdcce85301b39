//! Recordings: everything that happened in a run, in one MCAP file that any viewer opens.
//!
//! ```text
//!  rt loop --LoopMessage--> ring --> thread --> writer --> FILE.mcap --> reader --> identify, replay, report
//!                          (wait-free)          |                        |
//!                                               +-- messages, schema ----+
//!                                               +-- continuity, digest --+
//! ```
//!
//! | module | contents |
//! |---|---|
//! | [`messages`], [`schema`] | the protobuf messages of the channels `/loop`, `/event`, `/timing` and their description |
//! | `writer` | [`Recorder`]: creates the file, writes ticks and events, summarises each second, adds the results |
//! | `thread` | [`spawn`]: the recorder on its own thread, which a full disk does not stop |
//! | `disk` | [`DiskWatch`]: ends a run before its recording fills the disk |
//! | `walk`, `contents` | read a file record by record and return only checked data |
//! | `reader`, `stream` | [`Recording`]: opens complete and cut-off files, counts gaps, streams [`Ticks`] |
//! | `summary`, `scanner`, `losses` | read a damaged recording: pass over each damage to the next intact record |
//! | `boundary`, `file_range` | find the recordings in a file that holds several |
//! | `recover` | [`recover()`]: copies the intact parts of each recording in a cut-off or damaged file to a complete file |
//!
//! # Guarantees for a reader
//!
//! * A recording is never overwritten.
//! * Every tick between the first and the last is in the file, or its absence is counted: as an overrun if the loop reported
//!   it, otherwise as lost.
//! * Every double is read back bit for bit, including -0.0 and NaN.
//! * Changed data are never returned. The CRC of a chunk is checked before its first message, the CRC of an attachment before
//!   its use. Messages outside of chunks, which only other programs write, are counted if no CRC covers them. The messages of a channel are numbered, so a missing chunk is detected. In a complete file a CRC covers the
//!   whole data section as well. A file that ends early is read up to its end and reported as cut off; only its metadata
//!   record then has no CRC.
//! * Times in a recording are scheduled times since the loop began: two runs at virtual pace have the same bytes in all
//!   three channels.

#![deny(unsafe_code)]

mod attachments;
mod boundary;
mod contents;
mod continuity;
mod descriptor;
mod digest;
mod disk;
mod error;
mod event_message;
mod file_range;
mod live_encoder;
mod log_time;
mod losses;
pub mod messages;
mod reader;
mod recording_contents;
mod recover;
mod refusal;
mod scanner;
pub mod schema;
mod stream;
mod summary;
mod sync;
mod thread;
mod timing;
mod walk;
mod writer;

pub use attachments::{Preceding, StoredAttachment};
pub use continuity::Gap;
pub use disk::{
    BYTES_PER_TICK, DiskState, DiskWatch, MIN_FREE_BYTES, Shortage, free_bytes, lacks_space,
    nearest_existing, predicted_bytes,
};
pub use error::{Emptiness, RecordingError};
pub use event_message::event_text;
pub use live_encoder::{EncodedMessage, LiveEncoder};
pub use losses::{Cut, DamagedRange, MissingTicks};
pub use reader::Recording;
pub use recording_contents::TickReceiver;
pub use recover::{Recovered, Recovery, recover};
pub use schema::descriptor_set;
pub use stream::Ticks;
pub use sync::Syncable;
pub use thread::{Health, LiveCopy, RecorderHandle, spawn};
pub use timing::Quantiles;
pub use writer::{Header, Recorder, Totals};

/// Name of the attachment with the effective configuration.
pub const CONFIG_ATTACHMENT: &str = "config.toml";

/// Name of the metadata record.
pub const METADATA_RECORD: &str = "bench";

/// Metadata key of a recovered recording: what is missing in it.
const RECOVERED: &str = "recovered";

/// The channels of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Topic {
    /// A message for each tick.
    Loop,
    /// Changes and their reasons.
    Event,
    /// A message for each second.
    Timing,
}

impl Topic {
    /// All channels.
    pub const ALL: [Topic; 3] = [Topic::Loop, Topic::Event, Topic::Timing];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Topic::Loop => "/loop",
            Topic::Event => "/event",
            Topic::Timing => "/timing",
        }
    }

    /// Name of its message in the schema.
    pub fn schema_name(self) -> &'static str {
        match self {
            Topic::Loop => "bench.Loop",
            Topic::Event => "bench.Event",
            Topic::Timing => "bench.Timing",
        }
    }
}
