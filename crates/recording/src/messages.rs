//! The three messages of a recording: their wire format, their descriptors, and their conversion from and to the records of the
//! loop.
//!
//! One line of `messages!` defines a field for both: for prost, which encodes it, and for the descriptor, by which readers in
//! other languages decode it. The messages are protobuf (proto3). A `double` is marked `required`, which for prost means *always
//! written*: a proto3 writer leaves out a field that equals zero, and -0.0 does, so its sign would be lost. Readers see an ordinary
//! proto3 `double`.
//!
//! Numbers of enumerations begin with the meaning of an absent field: no measurement, disarmed.

use bench_hal::Validity;
use prost_types::DescriptorProto;
use prost_types::field_descriptor_proto::Type;

use super::descriptor;
use bench_rt::arming::State;
use bench_rt::record::TickRecord;

/// Rust type of a field.
macro_rules! rust_type {
    (uint64) => { u64 };
    (uint32) => { u32 };
    (sint64) => { i64 };
    (int32) => { i32 };
    (string) => { String };
    (double, required) => { f64 };
    (double, optional) => { Option<f64> };
}

/// Type of a field in the descriptor, and whether the field may be absent.
macro_rules! wire_type {
    (uint64) => {
        (Type::Uint64, false)
    };
    (uint32) => {
        (Type::Uint32, false)
    };
    (sint64) => {
        (Type::Sint64, false)
    };
    // The enumerations of Loop: prost writes them as their numbers.
    (int32) => {
        (Type::Enum, false)
    };
    (string) => {
        (Type::String, false)
    };
    (double, required) => {
        (Type::Double, false)
    };
    (double, optional) => {
        (Type::Double, true)
    };
}

/// Defines messages, each field by its number, its kind and its name.
macro_rules! messages {
    ($($(#[$doc:meta])* $name:ident {
        $($(#[$field_doc:meta])* field $tag:tt ($($kind:tt)*) $field:ident,)*
    })*) => {$(
        $(#[$doc])*
        #[derive(Clone, PartialEq, prost::Message)]
        pub struct $name {
            $($(#[$field_doc])* #[prost($($kind)*, tag = $tag)] pub $field: rust_type!($($kind)*),)*
        }

        impl $name {
            pub(super) fn descriptor() -> DescriptorProto {
                let fields = [$(($tag, stringify!($field), wire_type!($($kind)*)),)*];
                descriptor::message(stringify!($name), &fields)
            }
        }
    )*};
}

messages! {
    /// One tick, on channel `/loop`. Fields as in [`TickRecord`].
    Loop {
        /// Number of the tick.
        field "1" (uint64) tick,
        /// Scheduled time since the loop started.
        field "2" (uint64) scheduled_ns,
        /// Start of the tick.
        field "3" (uint64) woke_ns,
        /// Time at which the command was written.
        field "4" (uint64) done_ns,
        /// Reference.
        field "5" (double, required) reference_m,
        /// Measured position.
        field "6" (double, required) position_m,
        /// Set-point before the interlocks.
        field "7" (double, required) requested_a,
        /// Set-point as the amplifier accepted it.
        field "8" (double, required) command_a,
        /// Number of the measurement.
        field "9" (uint64) probe_sequence,
        /// Age of the measurement.
        field "10" (uint64) probe_age_ns,
        /// Number of a [`Validity`].
        field "11" (int32) validity,
        /// Number of a [`State`].
        field "12" (int32) state,
        /// Sum of [`bench_rt::record::flag`].
        field "13" (uint32) flags,
        /// Scheduled ticks not served, directly before this one.
        field "14" (uint32) missed_ticks,
        /// Measured current, if the amplifier measures it.
        field "15" (double, optional) actual_a,
        /// Reading of the probe before the correction, if a calibration is in use.
        field "16" (double, optional) raw_position_m,
        /// Set-point of the amplifier before the correction, if a calibration is in use.
        field "17" (double, optional) raw_command_a,
    }
    /// A change, on channel `/event`. The meaning of the fields depends on `kind`.
    Event {
        /// The tick at which it took effect.
        field "1" (uint64) tick,
        /// `order`, `state`, `trip`, `completed`, `lost`, `override` or `clock`.
        field "2" (string) kind,
        /// Readable text, for every kind.
        field "3" (string) text,
        /// Of an order: `arm`, `start`, `finish`, `stop`, `clear` or `tune`.
        field "4" (string) order,
        /// Of a state: the state before.
        field "5" (string) from,
        /// Of a state: the state after.
        field "6" (string) to,
        /// Of a trip: the short reason.
        field "7" (string) reason,
        /// Of a trip: the value that crossed its limit, in metres, amperes, seconds or as a count, by the reason.
        field "8" (double, required) value,
        /// Of a trip: the limit, in the unit of `value`.
        field "9" (double, required) limit,
        /// Of a trip of the amplifier: the number of the device.
        field "10" (sint64) code,
        /// Of `lost`: the number of records that did not fit into the ring.
        field "11" (uint64) records,
        /// Of a trip: what the operator can do about it.
        field "12" (string) remedy,
        /// Of an order of the supervisor: its number, from 1.
        field "13" (uint64) id,
        /// Of an order that was refused: the short reason.
        field "14" (string) refusal,
        /// Of `clock`: nanoseconds since the loop started.
        field "15" (uint64) loop_ns,
        /// Of `clock`: the monotonic clock of the system at the same moment.
        field "16" (uint64) monotonic_ns,
        /// Of `clock`: nanoseconds since 1970 at the same moment.
        field "17" (uint64) wall_ns,
        /// Of an order: who gave it, if it was not the supervisor: `signal` or `lease`.
        field "18" (string) origin,
        /// Of the order `tune`: the factor of the reference.
        field "19" (double, optional) reference_factor,
        /// Of the order `tune`: the factor of the loop gain.
        field "20" (double, optional) gain_factor,
        /// Of the order `tune`: length of the ramp in ticks.
        field "21" (uint64) ramp_ticks,
        /// Of a trip `model_error`: the modelled position in metres; `value` is the filtered difference from it.
        field "22" (double, optional) modelled_m,
    }
    /// A summary of up to one second of scheduled time, on channel `/timing`.
    Timing {
        /// First tick of the summary.
        field "1" (uint64) first_tick,
        /// Last tick of the summary.
        field "2" (uint64) last_tick,
        /// Recorded ticks.
        field "3" (uint64) ticks,
        /// Scheduled ticks that were not served.
        field "4" (uint64) overruns,
        /// Records lost between loop and recording.
        field "5" (uint64) lost_records,
        /// Median of woke - scheduled.
        field "6" (uint64) lateness_p50_ns,
        /// 99 % quantile of woke - scheduled.
        field "7" (uint64) lateness_p99_ns,
        /// 99.99 % quantile of woke - scheduled.
        field "8" (uint64) lateness_p9999_ns,
        /// Largest woke - scheduled.
        field "9" (uint64) lateness_max_ns,
        /// Median of done - woke.
        field "10" (uint64) compute_p50_ns,
        /// 99 % quantile of done - woke.
        field "11" (uint64) compute_p99_ns,
        /// 99.99 % quantile of done - woke.
        field "12" (uint64) compute_p9999_ns,
        /// Largest done - woke.
        field "13" (uint64) compute_max_ns,
    }
}

/// The validities with their names; the index is the number in a message.
pub(super) const VALIDITIES: [(Validity, &str); 4] = [
    (Validity::Missing, "missing"),
    (Validity::Valid, "valid"),
    (Validity::OutOfRange, "out_of_range"),
    (Validity::Faulty, "faulty"),
];

/// The states; the index is the number in a message.
pub(super) const STATES: [State; 6] = [
    State::Disarmed,
    State::Armed,
    State::Running,
    State::Tripped,
    State::Settling,
    State::Enabling,
];

/// A name or number in a message that this version of the program does not know.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "{field} {found:?} is unknown to this version of bench; use the version that made the recording"
)]
pub struct UnknownValue {
    field: &'static str,
    found: String,
}

pub(super) fn unknown(field: &'static str, found: impl ToString) -> UnknownValue {
    let found = found.to_string();
    UnknownValue { field, found }
}

impl From<&TickRecord> for Loop {
    fn from(record: &TickRecord) -> Loop {
        Loop {
            tick: record.tick,
            scheduled_ns: record.scheduled_ns,
            woke_ns: record.woke_ns,
            done_ns: record.done_ns,
            reference_m: record.reference_m,
            position_m: record.position_m,
            requested_a: record.requested_a,
            command_a: record.command_a,
            probe_sequence: record.probe_sequence,
            probe_age_ns: record.probe_age_ns,
            validity: number(VALIDITIES.map(|(validity, _)| validity), record.validity),
            state: number(STATES, record.state),
            flags: record.flags,
            missed_ticks: record.missed_ticks,
            actual_a: record.actual_a,
            raw_position_m: record.raw_position_m,
            raw_command_a: record.raw_command_a,
        }
    }
}

impl TryFrom<&Loop> for TickRecord {
    type Error = UnknownValue;

    fn try_from(message: &Loop) -> Result<TickRecord, UnknownValue> {
        let validities = VALIDITIES.map(|(validity, _)| validity);
        Ok(TickRecord {
            tick: message.tick,
            scheduled_ns: message.scheduled_ns,
            woke_ns: message.woke_ns,
            done_ns: message.done_ns,
            reference_m: message.reference_m,
            position_m: message.position_m,
            requested_a: message.requested_a,
            command_a: message.command_a,
            probe_sequence: message.probe_sequence,
            probe_age_ns: message.probe_age_ns,
            validity: value("validity", validities, message.validity)?,
            state: value("state", STATES, message.state)?,
            flags: message.flags,
            missed_ticks: message.missed_ticks,
            actual_a: message.actual_a,
            raw_position_m: message.raw_position_m,
            raw_command_a: message.raw_command_a,
        })
    }
}

/// The number of a value: its index. Every value of the two types is in its table.
fn number<T: PartialEq, const N: usize>(values: [T; N], value: T) -> i32 {
    let index = values.iter().position(|other| *other == value);
    index.unwrap_or_default() as i32
}

fn value<T: Copy, const N: usize>(
    field: &'static str,
    values: [T; N],
    number: i32,
) -> Result<T, UnknownValue> {
    let index = usize::try_from(number).ok();
    let value = index.and_then(|index| values.get(index));
    value.copied().ok_or_else(|| unknown(field, number))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rejects_numbers_of_a_later_version() {
        let good = Loop::from(&TickRecord {
            validity: Validity::Valid,
            ..TickRecord::default()
        });
        assert_eq!(
            TickRecord::try_from(&good).map(|record| record.validity),
            Ok(Validity::Valid)
        );
        for number in [4, -1, i32::MAX] {
            let later = Loop {
                validity: number,
                ..good
            };
            let error = TickRecord::try_from(&later)
                .expect_err("unknown")
                .to_string();
            assert!(error.contains("validity") && error.contains(&number.to_string()));
        }
        for number in [6, -1, i32::MAX] {
            let later = Loop {
                state: number,
                ..good
            };
            assert!(TickRecord::try_from(&later).is_err());
        }
    }

    #[test]
    fn an_empty_message_is_disarmed_without_a_measurement() {
        let record = TickRecord::try_from(&Loop::default()).expect("all fields have a meaning");
        assert_eq!(
            (record.validity, record.state),
            (Validity::Missing, State::Disarmed)
        );
    }

    #[test]
    fn every_validity_and_state_has_a_number() {
        let validities = [
            Validity::Valid,
            Validity::OutOfRange,
            Validity::Faulty,
            Validity::Missing,
        ];
        for (validity, state) in validities.into_iter().zip(STATES) {
            let record = TickRecord {
                validity,
                state,
                ..TickRecord::default()
            };
            assert_eq!(TickRecord::try_from(&Loop::from(&record)), Ok(record));
        }
    }
}
