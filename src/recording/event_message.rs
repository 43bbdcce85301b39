//! Changes of the loop as messages of `/event`, and back, without loss.

use super::messages::{Event as Message, Unknown, unknown};
use crate::rt::arming::{State, Trip};
use crate::rt::record::{Event, EventKind, RequestKind};

impl From<&Event> for Message {
    fn from(event: &Event) -> Message {
        let message = match event.kind {
            EventKind::Request(order) => of_order(order),
            EventKind::State { from, to } => of_state(from, to),
            EventKind::Trip(trip) => of_trip(trip),
            EventKind::Completed => of("completed", "the program came to its end".into()),
            EventKind::Lost { records } => Message {
                records,
                ..of(
                    "lost",
                    format!("{records} records did not fit into the ring"),
                )
            },
        };
        Message {
            tick: event.tick,
            ..message
        }
    }
}

fn of(kind: &str, text: String) -> Message {
    Message {
        kind: kind.into(),
        text,
        ..Message::default()
    }
}

fn of_order(order: RequestKind) -> Message {
    let name = order_name(order);
    Message {
        order: name.into(),
        ..of("order", format!("order: {name}"))
    }
}

fn of_state(from: State, to: State) -> Message {
    let text = format!("{} -> {}", from.name(), to.name());
    Message {
        from: from.name().into(),
        to: to.name().into(),
        ..of("state", text)
    }
}

fn of_trip(trip: Trip) -> Message {
    let (value, limit) = trip.value_and_limit().unwrap_or_default();
    let code = if let Trip::Amplifier { code, .. } = trip {
        code
    } else {
        0
    };
    let remedy = trip.remedy().into();
    Message {
        reason: trip.reason().into(),
        value,
        limit,
        code,
        remedy,
        ..of("trip", trip.to_string())
    }
}

fn order_name(order: RequestKind) -> &'static str {
    match order {
        RequestKind::Arm => "arm",
        RequestKind::Start => "start",
        RequestKind::Stop => "stop",
        RequestKind::Clear => "clear",
    }
}

impl TryFrom<&Message> for Event {
    type Error = Unknown;

    fn try_from(message: &Message) -> Result<Event, Unknown> {
        let kind = match message.kind.as_str() {
            "order" => EventKind::Request(order(&message.order)?),
            "state" => EventKind::State {
                from: state("from", &message.from)?,
                to: state("to", &message.to)?,
            },
            "trip" => EventKind::Trip(trip(message)?),
            "completed" => EventKind::Completed,
            "lost" => EventKind::Lost {
                records: message.records,
            },
            other => return Err(unknown("kind", other)),
        };
        Ok(Event {
            tick: message.tick,
            kind,
        })
    }
}

fn order(name: &str) -> Result<RequestKind, Unknown> {
    const ALL: [RequestKind; 4] = [
        RequestKind::Arm,
        RequestKind::Start,
        RequestKind::Stop,
        RequestKind::Clear,
    ];
    ALL.into_iter()
        .find(|o| order_name(*o) == name)
        .ok_or_else(|| unknown("order", name))
}

fn state(field: &'static str, name: &str) -> Result<State, Unknown> {
    const ALL: [State; 4] = [
        State::Disarmed,
        State::Armed,
        State::Running,
        State::Tripped,
    ];
    ALL.into_iter()
        .find(|s| s.name() == name)
        .ok_or_else(|| unknown(field, name))
}

fn trip(message: &Message) -> Result<Trip, Unknown> {
    let &Message {
        value, limit, code, ..
    } = message;
    Ok(match message.reason.as_str() {
        "travel" => Trip::Travel {
            position_m: value,
            limit_m: limit,
        },
        "peak_current" => Trip::PeakCurrent {
            command_a: value,
            limit_a: limit,
        },
        "continuous_current" => Trip::ContinuousCurrent {
            thermal_a: value,
            limit_a: limit,
        },
        "command_not_finite" => Trip::CommandNotFinite,
        "probe_invalid" => Trip::ProbeInvalid,
        "probe_stale" => Trip::ProbeStale {
            age_s: value,
            limit_s: limit,
        },
        "probe_stuck" => Trip::ProbeStuck {
            unchanged_s: value,
            limit_s: limit,
        },
        "current_not_followed" => Trip::CurrentNotFollowed {
            actual_a: value,
            command_a: limit,
        },
        // Counts were u32 and come back whole: every u32 is a double.
        "overruns" => Trip::Overruns {
            count: value as u32,
            limit: limit as u32,
        },
        "amplifier" => Trip::Amplifier { code, words: None },
        other => return Err(unknown("reason", other)),
    })
}
