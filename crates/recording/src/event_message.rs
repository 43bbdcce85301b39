//! Conversion of the events of the loop to messages of `/event` and back, without loss. The digest of a run includes the texts:
//! they must not change between versions.

use bench_hal::FaultText;

use super::messages::{Event as Message, STATES, UnknownValue, unknown};
use bench_rt::arming::{State, Trip};
use bench_rt::record::{ClockTimes, Event, EventKind, Origin, Refusal, RequestEvent, RequestKind};
use bench_rt::tuning::{Factors, Tune};

impl From<&Event> for Message {
    fn from(event: &Event) -> Message {
        let message = match event.kind {
            EventKind::Request(request) => of_request(request),
            EventKind::State { from, to } => of_state(from, to),
            EventKind::Trip(trip) => of_trip(trip),
            EventKind::ResetFailed { code, text } => of_failed_reset(code, text),
            EventKind::Completed => message("completed", "the program came to its end".into()),
            EventKind::Lost { records } => of_lost(records),
            EventKind::Override => of_override(""),
            EventKind::Clock(times) => of_clock(times),
        };
        Message {
            tick: event.tick,
            ..message
        }
    }
}

/// The text of an event, as in a recording.
pub fn event_text(event: &Event) -> String {
    Message::from(event).text
}

fn message(kind: &str, text: String) -> Message {
    Message {
        kind: kind.into(),
        text,
        ..Message::default()
    }
}

fn of_request(request: RequestEvent) -> Message {
    let name = request_name(request.kind);
    let message = Message {
        order: name.into(),
        id: request.id,
        refusal: request.refusal.map_or("", Refusal::name).into(),
        origin: origin_name(request.origin).into(),
        ..message("order", format!("order: {name}"))
    };
    match request.kind {
        RequestKind::Tune(tune) => with_tune(message, &tune),
        RequestKind::Arm
        | RequestKind::Start
        | RequestKind::Finish
        | RequestKind::Stop
        | RequestKind::Clear => message,
    }
}

fn with_tune(message: Message, tune: &Tune) -> Message {
    let Factors { reference, gain } = tune.factors();
    let ramp_ticks = tune.ramp_ticks();
    Message {
        text: format!(
            "order: tune the reference to {reference} and the gain to {gain} times within {ramp_ticks} ticks"
        ),
        reference_factor: Some(reference),
        gain_factor: Some(gain),
        ramp_ticks,
        ..message
    }
}

fn request_name(kind: RequestKind) -> &'static str {
    match kind {
        RequestKind::Arm => "arm",
        RequestKind::Start => "start",
        RequestKind::Finish => "finish",
        RequestKind::Stop => "stop",
        RequestKind::Clear => "clear",
        RequestKind::Tune(_) => "tune",
    }
}

fn of_state(from: State, to: State) -> Message {
    let (from, to) = (from.name(), to.name());
    Message {
        from: from.into(),
        to: to.into(),
        ..message("state", format!("{from} -> {to}"))
    }
}

fn of_trip(trip: Trip) -> Message {
    let (value, limit) = trip.value_and_limit().unwrap_or_default();
    let code = match trip {
        Trip::Amplifier { code, .. } => code,
        _ => 0,
    };
    let modelled_m = match trip {
        Trip::ModelError { modelled_m, .. } => Some(modelled_m),
        _ => None,
    };
    Message {
        reason: trip.reason().into(),
        value,
        limit,
        modelled_m,
        code,
        remedy: trip.remedy().into(),
        ..message("trip", trip.to_string())
    }
}

fn of_failed_reset(code: i64, text: Option<FaultText>) -> Message {
    let what = text.map_or("the amplifier keeps its fault", |text| text.what);
    Message {
        code,
        remedy: text.map_or("", |text| text.remedy).into(),
        ..message(
            "reset_failed",
            format!("reset failed: {what} (code {code})"),
        )
    }
}

fn of_lost(records: u64) -> Message {
    let text = format!("{records} records did not fit into the ring");
    Message {
        records,
        ..message("lost", text)
    }
}

/// The message of an override with the reason of the operator.
pub(super) fn of_override(reason: &str) -> Message {
    message(
        "override",
        format!("the operator closes the loop without a valid certificate: {reason}"),
    )
}

fn of_clock(times: ClockTimes) -> Message {
    let ClockTimes {
        loop_ns,
        monotonic_ns,
        wall_ns,
    } = times;
    Message {
        loop_ns,
        monotonic_ns,
        wall_ns,
        ..message("clock", "clocks of the system".into())
    }
}

impl TryFrom<&Message> for Event {
    type Error = UnknownValue;

    fn try_from(message: &Message) -> Result<Event, UnknownValue> {
        let kind = match message.kind.as_str() {
            "order" => EventKind::Request(request(message)?),
            "state" => EventKind::State {
                from: state("from", &message.from)?,
                to: state("to", &message.to)?,
            },
            "trip" => EventKind::Trip(trip(message)?),
            "reset_failed" => EventKind::ResetFailed {
                code: message.code,
                text: None,
            },
            "completed" => EventKind::Completed,
            "lost" => EventKind::Lost {
                records: message.records,
            },
            "override" => EventKind::Override,
            "clock" => EventKind::Clock(ClockTimes {
                loop_ns: message.loop_ns,
                monotonic_ns: message.monotonic_ns,
                wall_ns: message.wall_ns,
            }),
            other => return Err(unknown("kind", other)),
        };
        Ok(Event {
            tick: message.tick,
            kind,
        })
    }
}

fn request(message: &Message) -> Result<RequestEvent, UnknownValue> {
    Ok(RequestEvent {
        id: message.id,
        kind: request_kind(message)?,
        refusal: refusal(&message.refusal)?,
        origin: origin(&message.origin)?,
    })
}

fn request_kind(message: &Message) -> Result<RequestKind, UnknownValue> {
    match message.order.as_str() {
        "arm" => Ok(RequestKind::Arm),
        "start" => Ok(RequestKind::Start),
        "finish" => Ok(RequestKind::Finish),
        "stop" => Ok(RequestKind::Stop),
        "clear" => Ok(RequestKind::Clear),
        "tune" => Ok(RequestKind::Tune(tune(message)?)),
        other => Err(unknown("order", other)),
    }
}

fn tune(message: &Message) -> Result<Tune, UnknownValue> {
    let factors = Factors {
        reference: message.reference_factor.unwrap_or(f64::NAN),
        gain: message.gain_factor.unwrap_or(f64::NAN),
    };
    let tune = Tune::new(factors, message.ramp_ticks);
    tune.map_err(|error| unknown("order", error))
}

/// Empty for the supervisor, as in recordings of older versions.
fn origin_name(origin: Origin) -> &'static str {
    match origin {
        Origin::Supervisor => "",
        Origin::Signal => "signal",
        Origin::Lease => "lease",
    }
}

fn origin(name: &str) -> Result<Origin, UnknownValue> {
    let origins = [Origin::Supervisor, Origin::Signal, Origin::Lease];
    let mut origins = origins.into_iter();
    let found = origins.find(|other| origin_name(*other) == name);
    found.ok_or_else(|| unknown("origin", name))
}

/// The refusal of a name; an empty name belongs to an accepted request.
fn refusal(name: &str) -> Result<Option<Refusal>, UnknownValue> {
    if name.is_empty() {
        return Ok(None);
    }
    let found = Refusal::ALL.into_iter().find(|other| other.name() == name);
    found.map(Some).ok_or_else(|| unknown("refusal", name))
}

fn state(field: &'static str, name: &str) -> Result<State, UnknownValue> {
    let found = STATES.into_iter().find(|state| state.name() == name);
    found.ok_or_else(|| unknown(field, name))
}

/// The trip whose [`Trip::reason`] the message states.
fn trip(message: &Message) -> Result<Trip, UnknownValue> {
    let (value, limit) = (message.value, message.limit);
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
        "set_point_not_accepted" => Trip::SetPointNotAccepted {
            accepted_a: value,
            expected_a: limit,
        },
        "amplifier_disabled" => Trip::AmplifierDisabled,
        "current_not_followed" => Trip::CurrentNotFollowed {
            actual_a: value,
            command_a: limit,
        },
        "model_error" => Trip::ModelError {
            error_m: value,
            modelled_m: message
                .modelled_m
                .ok_or_else(|| unknown("modelled_m", "nothing"))?,
            limit_m: limit,
        },
        // Exact: every u32 is a double.
        "overruns" => Trip::Overruns {
            count: value as u32,
            limit: limit as u32,
        },
        "amplifier" => Trip::Amplifier {
            code: message.code,
            text: None,
        },
        other => return Err(unknown("reason", other)),
    })
}
