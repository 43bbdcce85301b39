//! The three messages of a recording, and how they stand for the loop's own records.
//!
//! Protobuf (proto3), written by derive; [`super::schema`] describes the same fields to readers in other languages.
//! Each `f64` is marked `required`, which for prost only means *always written*: a proto3 writer leaves out a field that
//! equals zero, and -0.0 does, so its sign would be lost. Readers see an ordinary proto3 `double`.
//!
//! Numbers of enumerations begin with what an absent field must mean: no measurement, disarmed.

use bench_hal::Validity;

use crate::rt::arming::State;
use crate::rt::record::TickRecord;

/// One tick, on channel `/loop`. Fields as in [`TickRecord`].
#[derive(Clone, PartialEq, prost::Message)]
#[allow(missing_docs, reason = "each field is that of TickRecord")]
pub struct Loop {
    #[prost(uint64, tag = "1")]
    pub tick: u64,
    #[prost(uint64, tag = "2")]
    pub scheduled_ns: u64,
    #[prost(uint64, tag = "3")]
    pub woke_ns: u64,
    #[prost(uint64, tag = "4")]
    pub done_ns: u64,
    #[prost(double, required, tag = "5")]
    pub reference_m: f64,
    #[prost(double, required, tag = "6")]
    pub position_m: f64,
    #[prost(double, required, tag = "7")]
    pub requested_a: f64,
    #[prost(double, required, tag = "8")]
    pub command_a: f64,
    #[prost(uint64, tag = "9")]
    pub probe_sequence: u64,
    #[prost(uint64, tag = "10")]
    pub probe_age_ns: u64,
    #[prost(enumeration = "ValidityCode", tag = "11")]
    pub validity: i32,
    #[prost(enumeration = "StateCode", tag = "12")]
    pub state: i32,
    #[prost(uint32, tag = "13")]
    pub flags: u32,
    #[prost(uint32, tag = "14")]
    pub missed_ticks: u32,
    #[prost(double, optional, tag = "15")]
    pub actual_a: Option<f64>,
}

/// Something changed, on channel `/event`. Which fields have a meaning depends on `kind`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Event {
    /// The tick at which it took effect.
    #[prost(uint64, tag = "1")]
    pub tick: u64,
    /// `order`, `state`, `trip`, `completed` or `lost`.
    #[prost(string, tag = "2")]
    pub kind: String,
    /// For a person, whatever the kind.
    #[prost(string, tag = "3")]
    pub text: String,
    /// `arm`, `start`, `stop` or `clear`, of an order.
    #[prost(string, tag = "4")]
    pub order: String,
    /// State before, of a state.
    #[prost(string, tag = "5")]
    pub from: String,
    /// State after, of a state.
    #[prost(string, tag = "6")]
    pub to: String,
    /// Short reason, of a trip.
    #[prost(string, tag = "7")]
    pub reason: String,
    /// The value that crossed its limit, of a trip; metres, amperes, seconds or a count, as the reason has it.
    #[prost(double, required, tag = "8")]
    pub value: f64,
    /// The limit, in the unit of `value`.
    #[prost(double, required, tag = "9")]
    pub limit: f64,
    /// The device's own number, of a trip of the amplifier.
    #[prost(sint64, tag = "10")]
    pub code: i64,
    /// How many records did not fit into the ring, of `lost`.
    #[prost(uint64, tag = "11")]
    pub records: u64,
    /// What a person can do about it, of a trip.
    #[prost(string, tag = "12")]
    pub remedy: String,
}

/// A summary of up to one second of scheduled time, on channel `/timing`.
#[derive(Clone, PartialEq, prost::Message)]
pub struct Timing {
    /// First tick of the summary.
    #[prost(uint64, tag = "1")]
    pub first_tick: u64,
    /// Last tick of the summary.
    #[prost(uint64, tag = "2")]
    pub last_tick: u64,
    /// Ticks recorded.
    #[prost(uint64, tag = "3")]
    pub ticks: u64,
    /// Scheduled ticks that passed unserved.
    #[prost(uint64, tag = "4")]
    pub overruns: u64,
    /// Records lost between loop and recording.
    #[prost(uint64, tag = "5")]
    pub lost_records: u64,
    /// Median of woke - scheduled.
    #[prost(uint64, tag = "6")]
    pub lateness_p50_ns: u64,
    /// 99 % quantile of woke - scheduled.
    #[prost(uint64, tag = "7")]
    pub lateness_p99_ns: u64,
    /// 99.99 % quantile of woke - scheduled.
    #[prost(uint64, tag = "8")]
    pub lateness_p9999_ns: u64,
    /// Largest woke - scheduled.
    #[prost(uint64, tag = "9")]
    pub lateness_max_ns: u64,
    /// Median of done - woke.
    #[prost(uint64, tag = "10")]
    pub compute_p50_ns: u64,
    /// 99 % quantile of done - woke.
    #[prost(uint64, tag = "11")]
    pub compute_p99_ns: u64,
    /// 99.99 % quantile of done - woke.
    #[prost(uint64, tag = "12")]
    pub compute_p9999_ns: u64,
    /// Largest done - woke.
    #[prost(uint64, tag = "13")]
    pub compute_max_ns: u64,
}

/// [`Validity`] as a number of the schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, prost::Enumeration)]
#[repr(i32)]
#[allow(missing_docs, reason = "each value is that of Validity")]
pub enum ValidityCode {
    Missing = 0,
    Valid = 1,
    OutOfRange = 2,
    Faulty = 3,
}

/// [`State`] as a number of the schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq, prost::Enumeration)]
#[repr(i32)]
#[allow(missing_docs, reason = "each value is that of State")]
pub enum StateCode {
    Disarmed = 0,
    Armed = 1,
    Running = 2,
    Tripped = 3,
}

/// A word or number of a message that this version of the program does not know.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{field} {found:?} is unknown to this version of bench")]
pub struct Unknown {
    field: &'static str,
    found: String,
}

pub(super) fn unknown(field: &'static str, found: impl ToString) -> Unknown {
    Unknown {
        field,
        found: found.to_string(),
    }
}

impl From<&TickRecord> for Loop {
    fn from(t: &TickRecord) -> Loop {
        Loop {
            tick: t.tick,
            scheduled_ns: t.scheduled_ns,
            woke_ns: t.woke_ns,
            done_ns: t.done_ns,
            reference_m: t.reference_m,
            position_m: t.position_m,
            requested_a: t.requested_a,
            command_a: t.command_a,
            probe_sequence: t.probe_sequence,
            probe_age_ns: t.probe_age_ns,
            validity: validity_code(t.validity) as i32,
            state: state_code(t.state) as i32,
            flags: t.flags,
            missed_ticks: t.missed_ticks,
            actual_a: t.actual_a,
        }
    }
}

impl TryFrom<&Loop> for TickRecord {
    type Error = Unknown;

    fn try_from(m: &Loop) -> Result<TickRecord, Unknown> {
        Ok(TickRecord {
            tick: m.tick,
            scheduled_ns: m.scheduled_ns,
            woke_ns: m.woke_ns,
            done_ns: m.done_ns,
            reference_m: m.reference_m,
            position_m: m.position_m,
            requested_a: m.requested_a,
            command_a: m.command_a,
            probe_sequence: m.probe_sequence,
            probe_age_ns: m.probe_age_ns,
            validity: validity(m.validity)?,
            state: state(m.state)?,
            flags: m.flags,
            missed_ticks: m.missed_ticks,
            actual_a: m.actual_a,
        })
    }
}

fn validity_code(validity: Validity) -> ValidityCode {
    match validity {
        Validity::Missing => ValidityCode::Missing,
        Validity::Valid => ValidityCode::Valid,
        Validity::OutOfRange => ValidityCode::OutOfRange,
        Validity::Faulty => ValidityCode::Faulty,
    }
}

fn validity(number: i32) -> Result<Validity, Unknown> {
    Ok(
        match ValidityCode::try_from(number).map_err(|_| unknown("validity", number))? {
            ValidityCode::Missing => Validity::Missing,
            ValidityCode::Valid => Validity::Valid,
            ValidityCode::OutOfRange => Validity::OutOfRange,
            ValidityCode::Faulty => Validity::Faulty,
        },
    )
}

fn state_code(state: State) -> StateCode {
    match state {
        State::Disarmed => StateCode::Disarmed,
        State::Armed => StateCode::Armed,
        State::Running => StateCode::Running,
        State::Tripped => StateCode::Tripped,
    }
}

fn state(number: i32) -> Result<State, Unknown> {
    Ok(
        match StateCode::try_from(number).map_err(|_| unknown("state", number))? {
            StateCode::Disarmed => State::Disarmed,
            StateCode::Armed => State::Armed,
            StateCode::Running => State::Running,
            StateCode::Tripped => State::Tripped,
        },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_of_a_later_version_is_an_error_and_never_a_valid_measurement() {
        let good = Loop::from(&TickRecord {
            validity: Validity::Valid,
            ..TickRecord::default()
        });
        assert_eq!(
            TickRecord::try_from(&good).map(|t| t.validity),
            Ok(Validity::Valid)
        );
        for number in [4, -1, i32::MAX] {
            let error = TickRecord::try_from(&Loop {
                validity: number,
                ..good
            })
            .expect_err("unknown");
            assert!(
                error.to_string().contains("validity")
                    && error.to_string().contains(&number.to_string())
            );
            assert!(
                TickRecord::try_from(&Loop {
                    state: number,
                    ..good
                })
                .is_err()
            );
        }
    }

    #[test]
    fn an_empty_message_means_no_measurement_and_disarmed() {
        let tick = TickRecord::try_from(&Loop::default()).expect("all fields have a meaning");
        assert_eq!(
            (tick.validity, tick.state),
            (Validity::Missing, State::Disarmed)
        );
    }
}
