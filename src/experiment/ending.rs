//! How a run came to its end, as its loop or its recording tells it.

use serde::{Serialize, Serializer};

use crate::recording::Recording;
use crate::rt::arming::Trip;
use crate::rt::record::EventKind;
use crate::rt::thread::LoopOutcome;

/// The end of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ending {
    /// It ran to its end.
    Completed,
    /// An interlock tripped, at a tick.
    Tripped(Trip, u64),
    /// A person stopped it, or the system.
    Stopped,
    /// The recording ends before the run does.
    CutOff,
}

/// As its [`name`](Ending::name).
impl Serialize for Ending {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl From<&LoopOutcome> for Ending {
    fn from(ended: &LoopOutcome) -> Ending {
        Ending::by(ended.trip, ended.completed)
    }
}

impl Ending {
    /// By the events of a recording. A trip counts though the program had come to its end; a file that is still being written
    /// has no end of its own, and is whole for all that if the program had come to its.
    pub fn of(recording: &Recording) -> Ending {
        let trip = recording
            .events()
            .iter()
            .find_map(|event| match event.kind {
                EventKind::Trip(trip) => Some((trip, event.tick)),
                _ => None,
            });
        let completed = recording
            .events()
            .iter()
            .any(|event| event.kind == EventKind::Completed);
        match Ending::by(trip, completed) {
            Ending::Stopped if recording.truncated() => Ending::CutOff,
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
        match self {
            Ending::Completed => "completed",
            Ending::Tripped(..) => "tripped",
            Ending::Stopped => "stopped",
            Ending::CutOff => "cut_off",
        }
    }

    /// What must be told beside all that such a run shows; nothing of one that completed.
    pub fn caution(&self) -> Option<String> {
        let how = match self {
            Ending::Completed => return None,
            Ending::Tripped(trip, tick) => format!("the run tripped at tick {tick} ({trip})"),
            Ending::Stopped => "the run was stopped before its end".into(),
            Ending::CutOff => "the recording is cut off before the end of its run".into(),
        };
        Some(format!("{how}: this is what was recorded until then"))
    }
}
