//! How a run ended, by its loop or by its recording.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};

use bench_recording::Recording;
use bench_rt::arming::Trip;
use bench_rt::record::{Event, EventKind, RequestKind};
use bench_rt::servo_run::ServoEnd;

/// The end of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ending {
    /// The program was completed.
    Completed,
    /// An interlock tripped, at a tick.
    Tripped(Trip, u64),
    /// The operator or the system stopped it.
    Stopped,
    /// The recording ends before the run.
    CutOff,
}

/// How a run or a command ended, as one word. The same words stand in results, in the answers of a daemon and in its metrics.
#[derive(
    Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum EndKind {
    /// It did what it was asked for.
    Completed,
    /// An interlock tripped.
    Tripped,
    /// It was stopped.
    Stopped,
    /// The recording ends before the run.
    CutOff,
    /// It was refused, or it failed.
    Failed,
}

impl EndKind {
    /// The word.
    pub fn name(self) -> &'static str {
        match self {
            EndKind::Completed => "completed",
            EndKind::Tripped => "tripped",
            EndKind::Stopped => "stopped",
            EndKind::CutOff => "cut_off",
            EndKind::Failed => "failed",
        }
    }
}

/// Serialised as its [`name`](Ending::name).
impl Serialize for Ending {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl From<&ServoEnd> for Ending {
    fn from(ended: &ServoEnd) -> Ending {
        Ending::by(ended.trip, ended.completed)
    }
}

impl Ending {
    /// The ending by the events of a recording. A trip after the program was completed counts as a trip. A file that is still
    /// being written is not cut off if the program was completed.
    pub fn of(recording: &Recording) -> Ending {
        let mut events = recording.events().iter();
        let completed = events.clone().any(|e| e.kind == EventKind::Completed);
        let was_ordered = |e: &Event| matches!(e.kind, EventKind::Request(request) if request.kind == RequestKind::Stop);
        let is_cut =
            recording.truncated() || recording.was_damaged() && !events.clone().any(was_ordered);
        let trip = events.find_map(|event| match event.kind {
            EventKind::Trip(trip) => Some((trip, event.tick)),
            _ => None,
        });
        match Ending::by(trip, completed) {
            Ending::Stopped if is_cut => Ending::CutOff,
            ending => ending,
        }
    }

    fn by(trip: Option<(Trip, u64)>, completed: bool) -> Ending {
        match (trip, completed) {
            (Some((trip, tick)), _) => Ending::Tripped(trip, tick),
            (None, true) => Ending::Completed,
            (None, false) => Ending::Stopped,
        }
    }

    /// The trip, if there was one, and its tick.
    pub fn trip(&self) -> Option<(Trip, u64)> {
        match self {
            Ending::Tripped(trip, tick) => Some((*trip, *tick)),
            _ => None,
        }
    }

    /// The name used in JSON.
    pub fn name(&self) -> &'static str {
        self.kind().name()
    }

    /// The ending without the trip.
    pub fn kind(&self) -> EndKind {
        match self {
            Ending::Completed => EndKind::Completed,
            Ending::Tripped(..) => EndKind::Tripped,
            Ending::Stopped => EndKind::Stopped,
            Ending::CutOff => EndKind::CutOff,
        }
    }

    /// A warning that belongs to all results of the run; `None` if it was completed.
    pub fn caution(&self) -> Option<String> {
        let how = match self {
            Ending::Completed => return None,
            Ending::Tripped(trip, tick) => format!("the run tripped at tick {tick} ({trip})"),
            Ending::Stopped => "the run was stopped before its end".into(),
            Ending::CutOff => "the recording is cut off before the end of the run".into(),
        };
        Some(format!("{how}: the results are from the data before it"))
    }
}
