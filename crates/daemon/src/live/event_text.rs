//! Events of the loop as text for clients.

use schemars::JsonSchema;
use serde::Serialize;

use bench_recording::event_text;
use bench_rt::record::{Event, EventKind};

/// An event.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct EventView {
    /// Time in seconds since the daemon started.
    pub time_s: f64,
    /// Number of the run; 0 between two runs.
    pub run: u32,
    /// Kind of the event.
    pub kind: EventClass,
    /// The event as in the recording.
    pub text: String,
}

/// Kinds of event that clients distinguish.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum EventClass {
    /// Another state of the loop.
    State,
    /// A trip.
    Trip,
    /// A request and its answer.
    Request,
    /// The program came to its end.
    Completed,
    /// Records were lost.
    Lost,
    /// The amplifier kept its fault.
    ResetFailed,
}

impl EventView {
    /// The event for clients; `None` for the clocks of the system, and for an override, which the recorder writes.
    pub fn of(event: &Event, time_s: f64, run: u32) -> Option<EventView> {
        let kind = match event.kind {
            EventKind::Request(_) => EventClass::Request,
            EventKind::State { .. } => EventClass::State,
            EventKind::Trip(_) => EventClass::Trip,
            EventKind::ResetFailed { .. } => EventClass::ResetFailed,
            EventKind::Completed => EventClass::Completed,
            EventKind::Lost { .. } => EventClass::Lost,
            EventKind::Override | EventKind::Clock(_) => return None,
        };
        Some(EventView {
            time_s,
            run,
            kind,
            text: event_text(event),
        })
    }
}
