//! The signals of a tick, with the unit in the name.

use crate::recording::messages::Loop;
use crate::rt::record::TickRecord;

/// What a signal is, for the axes of formats that ask for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// A time in seconds.
    Time,
    /// A displacement in metres.
    Displacement,
    /// A current in amperes.
    Current,
    /// A count or a code.
    Count,
}

/// The value of a signal in a tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sample {
    /// A quantity in SI units; `None` if it was not measured.
    Real(Option<f64>),
    /// A count or a code.
    Count(u64),
}

/// A signal.
#[derive(Clone, Copy, Debug)]
pub struct Signal {
    /// Name of the column, with the unit.
    pub name: &'static str,
    /// What it is.
    pub quantity: Quantity,
    /// Its value in a tick.
    pub value: fn(&TickRecord) -> Sample,
}

/// All signals, in the order of the columns. Names are those of the channel `/loop`; times are in seconds since the loop began.
pub const SIGNALS: [Signal; 17] = [
    signal("time_s", Quantity::Time, |t| seconds(t.scheduled_ns)),
    signal("reference_m", Quantity::Displacement, |t| {
        real(t.reference_m)
    }),
    signal("position_m", Quantity::Displacement, |t| real(t.position_m)),
    signal("requested_a", Quantity::Current, |t| real(t.requested_a)),
    signal("command_a", Quantity::Current, |t| real(t.command_a)),
    signal("actual_a", Quantity::Current, |t| Sample::Real(t.actual_a)),
    signal("raw_position_m", Quantity::Displacement, |t| {
        Sample::Real(t.raw_position_m)
    }),
    signal("raw_command_a", Quantity::Current, |t| {
        Sample::Real(t.raw_command_a)
    }),
    signal("lateness_s", Quantity::Time, |t| {
        seconds(t.woke_ns.saturating_sub(t.scheduled_ns))
    }),
    signal("compute_s", Quantity::Time, |t| {
        seconds(t.done_ns.saturating_sub(t.woke_ns))
    }),
    signal("probe_age_s", Quantity::Time, |t| seconds(t.probe_age_ns)),
    signal("tick", Quantity::Count, |t| Sample::Count(t.tick)),
    signal("probe_sequence", Quantity::Count, |t| {
        Sample::Count(t.probe_sequence)
    }),
    signal("validity", Quantity::Count, |t| {
        code(Loop::from(t).validity)
    }),
    signal("state", Quantity::Count, |t| code(Loop::from(t).state)),
    signal("flags", Quantity::Count, |t| {
        Sample::Count(u64::from(t.flags))
    }),
    signal("missed_ticks", Quantity::Count, |t| {
        Sample::Count(u64::from(t.missed_ticks))
    }),
];

const fn signal(
    name: &'static str,
    quantity: Quantity,
    value: fn(&TickRecord) -> Sample,
) -> Signal {
    Signal {
        name,
        quantity,
        value,
    }
}

fn real(value: f64) -> Sample {
    Sample::Real(Some(value))
}

/// The nearest double to a whole number of nanoseconds, in seconds (below 2^53 ns, 104 days).
fn seconds(nanoseconds: u64) -> Sample {
    real(nanoseconds as f64 / 1e9)
}

/// The number that the message has for a validity or a state, which is not negative.
fn code(number: i32) -> Sample {
    Sample::Count(u64::from(number.unsigned_abs()))
}

impl Signal {
    /// Whether it counts, so that whole numbers are stored.
    pub fn is_count(&self) -> bool {
        self.quantity == Quantity::Count
    }

    /// The value as a double; NaN where it was not measured.
    pub fn number(&self, record: &TickRecord) -> f64 {
        match (self.value)(record) {
            Sample::Real(value) => value.unwrap_or(f64::NAN),
            Sample::Count(count) => count as f64,
        }
    }
}
