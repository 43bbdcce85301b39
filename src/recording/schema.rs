//! The schema inside every recording: a protobuf `FileDescriptorSet` made in code, so that neither `protoc` nor a build
//! script is needed and any MCAP reader can decode the messages by name.

use prost::Message;
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    FileDescriptorProto, FileDescriptorSet, OneofDescriptorProto,
};

/// The bytes that go into each channel's schema record.
pub fn descriptor_set() -> Vec<u8> {
    let file = FileDescriptorProto {
        name: Some("bench.proto".into()),
        package: Some("bench".into()),
        syntax: Some("proto3".into()),
        message_type: vec![loop_message(), event_message(), timing_message()],
        ..FileDescriptorProto::default()
    };
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

fn loop_message() -> DescriptorProto {
    let mut message = message(
        "Loop",
        &[
            ("tick", Type::Uint64),
            ("scheduled_ns", Type::Uint64),
            ("woke_ns", Type::Uint64),
            ("done_ns", Type::Uint64),
            ("reference_m", Type::Double),
            ("position_m", Type::Double),
            ("requested_a", Type::Double),
            ("command_a", Type::Double),
            ("probe_sequence", Type::Uint64),
            ("probe_age_ns", Type::Uint64),
            ("validity", Type::Enum),
            ("state", Type::Enum),
            ("flags", Type::Uint32),
            ("missed_ticks", Type::Uint32),
            ("actual_a", Type::Double),
        ],
    );
    // Absent where the amplifier does not say: a proto3 `optional`, which descriptors write as a oneof of one.
    let actual = &mut message.field[14];
    (actual.proto3_optional, actual.oneof_index) = (Some(true), Some(0));
    message.oneof_decl = vec![OneofDescriptorProto {
        name: Some("_actual_a".into()),
        options: None,
    }];
    message.field[10].type_name = Some(".bench.Loop.Validity".into());
    message.field[11].type_name = Some(".bench.Loop.State".into());
    message.enum_type = vec![
        enumeration("Validity", &["missing", "valid", "out_of_range", "faulty"]),
        enumeration("State", &["disarmed", "armed", "running", "tripped"]),
    ];
    message
}

fn event_message() -> DescriptorProto {
    message(
        "Event",
        &[
            ("tick", Type::Uint64),
            ("kind", Type::String),
            ("text", Type::String),
            ("order", Type::String),
            ("from", Type::String),
            ("to", Type::String),
            ("reason", Type::String),
            ("value", Type::Double),
            ("limit", Type::Double),
            ("code", Type::Sint64),
            ("records", Type::Uint64),
            ("remedy", Type::String),
        ],
    )
}

fn timing_message() -> DescriptorProto {
    let names = [
        "first_tick",
        "last_tick",
        "ticks",
        "overruns",
        "lost_records",
        "lateness_p50_ns",
        "lateness_p99_ns",
        "lateness_p9999_ns",
        "lateness_max_ns",
        "compute_p50_ns",
        "compute_p99_ns",
        "compute_p9999_ns",
        "compute_max_ns",
    ];
    message("Timing", &names.map(|name| (name, Type::Uint64)))
}

/// A message whose fields are numbered from 1 in the order given.
fn message(name: &str, fields: &[(&str, Type)]) -> DescriptorProto {
    let field = |(number, (name, kind)): (i32, &(&str, Type))| FieldDescriptorProto {
        name: Some((*name).into()),
        number: Some(number),
        label: Some(Label::Optional.into()),
        r#type: Some((*kind).into()),
        ..FieldDescriptorProto::default()
    };
    DescriptorProto {
        name: Some(name.into()),
        field: (1..).zip(fields).map(field).collect(),
        ..DescriptorProto::default()
    }
}

/// An enumeration whose values are numbered from 0 in the order given, as in [`super::messages`].
fn enumeration(name: &str, values: &[&str]) -> EnumDescriptorProto {
    let value = |(number, name): (i32, &&str)| EnumValueDescriptorProto {
        name: Some((*name).into()),
        number: Some(number),
        ..EnumValueDescriptorProto::default()
    };
    EnumDescriptorProto {
        name: Some(name.into()),
        value: (0..).zip(values).map(value).collect(),
        ..EnumDescriptorProto::default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::messages::{Event, Loop, StateCode, Timing, ValidityCode};
    use super::*;
    use crate::rt::arming::State;
    use crate::rt::record::TickRecord;

    /// A message with every field set, by its field numbers on the wire: (number, wire type), by a reader of its own.
    fn wire(mut bytes: &[u8]) -> Vec<(i32, u8)> {
        let mut fields = Vec::new();
        while !bytes.is_empty() {
            let key = prost::encoding::decode_varint(&mut bytes).expect("a key");
            fields.push(((key >> 3) as i32, (key & 7) as u8));
            let skip = match key & 7 {
                0 => prost::encoding::decode_varint(&mut bytes)
                    .map(|_| 0)
                    .expect("a number"),
                1 => 8,
                2 => prost::encoding::decode_varint(&mut bytes).expect("a length") as usize,
                other => panic!("wire type {other}"),
            };
            bytes = &bytes[skip..];
        }
        fields
    }

    fn described(message: &DescriptorProto) -> Vec<(i32, u8)> {
        let wire_type = |kind: Type| match kind {
            Type::Double => 1,
            Type::String => 2,
            Type::Uint64 | Type::Uint32 | Type::Sint64 | Type::Enum => 0,
            other => panic!("{other:?} is not used"),
        };
        message
            .field
            .iter()
            .map(|f| (f.number(), wire_type(f.r#type())))
            .collect()
    }

    #[test]
    fn the_schema_describes_every_field_that_is_written() {
        let tick = Loop {
            tick: 1,
            scheduled_ns: 1,
            woke_ns: 1,
            done_ns: 1,
            reference_m: 1.0,
            position_m: 1.0,
            requested_a: 1.0,
            command_a: 1.0,
            probe_sequence: 1,
            probe_age_ns: 1,
            validity: 1,
            state: 1,
            flags: 1,
            missed_ticks: 1,
            actual_a: Some(1.0),
        };
        let s = || "s".to_string();
        let event = Event {
            tick: 1,
            kind: s(),
            text: s(),
            order: s(),
            from: s(),
            to: s(),
            reason: s(),
            value: 1.0,
            limit: 1.0,
            code: 1,
            records: 1,
            remedy: s(),
        };
        let timing = Timing {
            first_tick: 1,
            last_tick: 1,
            ticks: 1,
            overruns: 1,
            lost_records: 1,
            lateness_p50_ns: 1,
            lateness_p99_ns: 1,
            lateness_p9999_ns: 1,
            lateness_max_ns: 1,
            compute_p50_ns: 1,
            compute_p99_ns: 1,
            compute_p9999_ns: 1,
            compute_max_ns: 1,
        };
        assert_eq!(described(&loop_message()), wire(&tick.encode_to_vec()));
        assert_eq!(described(&event_message()), wire(&event.encode_to_vec()));
        assert_eq!(described(&timing_message()), wire(&timing.encode_to_vec()));
    }

    #[test]
    fn doubles_are_written_even_when_they_equal_zero() {
        let zero = Loop::from(&TickRecord {
            reference_m: -0.0,
            ..TickRecord::default()
        });
        let doubles: Vec<_> = wire(&zero.encode_to_vec())
            .into_iter()
            .filter(|f| f.1 == 1)
            .collect();
        assert_eq!(doubles, [(5, 1), (6, 1), (7, 1), (8, 1)]);
    }

    #[test]
    fn the_names_of_enumerations_stand_at_their_numbers() {
        let enums = loop_message().enum_type;
        let name =
            |which: usize, number: i32| enums[which].value[number as usize].name().to_string();
        assert_eq!(name(0, ValidityCode::Valid as i32), "valid");
        assert_eq!(name(0, ValidityCode::OutOfRange as i32), "out_of_range");
        assert_eq!(name(0, ValidityCode::Faulty as i32), "faulty");
        assert_eq!(name(0, ValidityCode::Missing as i32), "missing");
        assert_eq!(name(1, StateCode::Running as i32), State::Running.name());
        assert_eq!(name(1, StateCode::Tripped as i32), State::Tripped.name());
        assert_eq!(name(1, StateCode::Armed as i32), State::Armed.name());
        assert_eq!(name(1, StateCode::Disarmed as i32), State::Disarmed.name());
    }
}
