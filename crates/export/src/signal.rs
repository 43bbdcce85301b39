//! The signals of a tick, with the unit in the name.

use bench_recording::messages::Loop;
use bench_rt::record::TickRecord;

/// What a real signal is, for the axes of formats that ask for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A time in seconds.
    Time,
    /// A displacement in metres.
    Displacement,
    /// A current in amperes.
    Current,
}

/// The value of a signal in a tick.
#[derive(Clone, Copy, Debug)]
pub enum Value {
    /// A quantity in SI units; `None` if it was not measured.
    Real(Quantity, fn(&TickRecord) -> Option<f64>),
    /// A count or a code.
    Count(fn(&TickRecord) -> u64),
}

/// A signal.
#[derive(Clone, Copy, Debug)]
pub struct Signal {
    /// Name of the column, with the unit.
    pub name: &'static str,
    /// Its value in a tick.
    pub value: Value,
}

/// All signals, in the order of the columns. Names are those of the channel `/loop`; times are in seconds since the loop began.
pub const SIGNALS: [Signal; 17] = [
    real("time_s", Quantity::Time, |t| seconds(t.scheduled_ns)),
    real("reference_m", Quantity::Displacement, |t| {
        Some(t.reference_m)
    }),
    real("position_m", Quantity::Displacement, |t| Some(t.position_m)),
    real("requested_a", Quantity::Current, |t| Some(t.requested_a)),
    real("command_a", Quantity::Current, |t| Some(t.command_a)),
    real("actual_a", Quantity::Current, |t| t.actual_a),
    real("raw_position_m", Quantity::Displacement, |t| {
        t.raw_position_m
    }),
    real("raw_command_a", Quantity::Current, |t| t.raw_command_a),
    real("lateness_s", Quantity::Time, |t| {
        seconds(t.woke_ns.saturating_sub(t.scheduled_ns))
    }),
    real("compute_s", Quantity::Time, |t| {
        seconds(t.done_ns.saturating_sub(t.woke_ns))
    }),
    real("probe_age_s", Quantity::Time, |t| seconds(t.probe_age_ns)),
    count("tick", |t| t.tick),
    count("probe_sequence", |t| t.probe_sequence),
    count("validity", |t| code(Loop::from(t).validity)),
    count("state", |t| code(Loop::from(t).state)),
    count("flags", |t| u64::from(t.flags)),
    count("missed_ticks", |t| u64::from(t.missed_ticks)),
];

const fn real(
    name: &'static str,
    quantity: Quantity,
    value: fn(&TickRecord) -> Option<f64>,
) -> Signal {
    Signal {
        name,
        value: Value::Real(quantity, value),
    }
}

const fn count(name: &'static str, value: fn(&TickRecord) -> u64) -> Signal {
    Signal {
        name,
        value: Value::Count(value),
    }
}

/// The nearest double to a whole number of nanoseconds, in seconds (below 2^53 ns, 104 days).
fn seconds(nanoseconds: u64) -> Option<f64> {
    Some(nanoseconds as f64 / 1e9)
}

/// The number that the message has for a validity or a state, which is not negative.
fn code(number: i32) -> u64 {
    u64::from(number.unsigned_abs())
}

impl Signal {
    /// The value as a double; NaN where it was not measured.
    pub fn number(&self, record: &TickRecord) -> f64 {
        match self.value {
            Value::Real(_, value) => value(record).unwrap_or(f64::NAN),
            Value::Count(value) => value(record) as f64,
        }
    }
}
