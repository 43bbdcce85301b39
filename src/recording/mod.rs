//! Recordings: everything a run did, in one MCAP file that any viewer opens.
//!
//! ```text
//!  rt loop --Published--> ring --> thread --> writer --> FILE.mcap --> reader --> identify, replay, report
//!                        (wait-free)          |                        |
//!                                             +-- messages, schema ----+
//!                                             +-- continuity, digest --+
//! ```
//!
//! | module | does |
//! |---|---|
//! | [`messages`], [`schema`] | the protobuf messages of the channels `/loop`, `/event`, `/timing` and their description |
//! | `writer` | [`Recorder`]: makes the file, writes ticks and events, sums up each second, finishes with results |
//! | `thread` | [`spawn`]: the recorder on a thread of its own, which a full disk does not stop |
//! | `walk` | goes through a file and hands out only what its checks vouch for |
//! | `reader`, `stream` | [`Recording`]: opens complete and cut-off files, accounts for gaps, streams [`Ticks`] |
//! | `recover` | [`recover()`]: what can be trusted of a cut or damaged file, as a complete one |
//!
//! # What a reader may rely on
//!
//! * A recording is never overwritten.
//! * Every tick between the first and the last is there, or its absence is counted: as an overrun if the loop says so,
//!   else as lost.
//! * A double comes back with every bit, -0.0 and NaN included.
//! * Nothing that was altered on the way is handed out: a chunk's CRC is checked before its first message, an
//!   attachment's before its use, and messages of a channel are numbered, so a chunk that vanished is noticed. In a
//!   complete file the CRC over the whole data section stands above all that. A file that ends early is read up to the
//!   cut and says that it is cut; only its metadata record then has no CRC.
//! * Time in a recording is scheduled time since the loop began: two runs in virtual pace have the same bytes in all
//!   three channels.

mod continuity;
mod descriptor;
mod digest;
mod error;
mod event_message;
pub mod messages;
mod reader;
mod recover;
pub mod schema;
mod stream;
mod thread;
mod timing;
mod walk;
mod writer;

pub use continuity::Gap;
pub use error::RecordingError;
pub use reader::{Cut, Recording, StoredAttachment};
pub use recover::{Recovered, recover};
pub use stream::Ticks;
pub use thread::{Health, RecorderHandle, spawn};
pub use timing::Quantiles;
pub use writer::{Header, Recorder, Totals};

/// Name of the attachment with the effective configuration.
pub const CONFIG_ATTACHMENT: &str = "config.toml";

/// Name of the metadata record.
pub const METADATA_RECORD: &str = "bench";

/// The channels of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Topic {
    Loop,
    Event,
    Timing,
}

impl Topic {
    const ALL: [Topic; 3] = [Topic::Loop, Topic::Event, Topic::Timing];

    fn name(self) -> &'static str {
        match self {
            Topic::Loop => "/loop",
            Topic::Event => "/event",
            Topic::Timing => "/timing",
        }
    }

    fn schema_name(self) -> &'static str {
        match self {
            Topic::Loop => "bench.Loop",
            Topic::Event => "bench.Event",
            Topic::Timing => "bench.Timing",
        }
    }
}
