//! The schema inside every recording: a protobuf `FileDescriptorSet` made from the definitions in [`super::messages`]. Neither
//! `protoc` nor a build script is needed, and any MCAP reader can decode the messages by name.

use prost::Message;
use prost_types::{DescriptorProto, FileDescriptorProto, FileDescriptorSet};

use super::descriptor::enumeration;
use super::messages::{Event, Loop, STATES, Timing, VALIDITIES};

/// The bytes of the schema record of each channel.
pub fn descriptor_set() -> Vec<u8> {
    let file = FileDescriptorProto {
        name: Some("bench.proto".into()),
        package: Some("bench".into()),
        syntax: Some("proto3".into()),
        message_type: vec![loop_descriptor(), Event::descriptor(), Timing::descriptor()],
        ..FileDescriptorProto::default()
    };
    FileDescriptorSet { file: vec![file] }.encode_to_vec()
}

/// The message of a tick with its two enumerations.
fn loop_descriptor() -> DescriptorProto {
    let mut message = Loop::descriptor();
    message.enum_type = vec![
        enumeration("Validity", VALIDITIES.map(|(_, name)| name)),
        enumeration("State", STATES.map(|state| state.name())),
    ];
    for field in &mut message.field {
        field.type_name = match field.name() {
            "validity" => Some(".bench.Loop.Validity".into()),
            "state" => Some(".bench.Loop.State".into()),
            _ => None,
        };
    }
    message
}

#[cfg(test)]
mod tests {
    use prost_types::field_descriptor_proto::Type;

    use super::*;
    use bench_rt::record::TickRecord;

    #[test]
    fn schema_changes_only_on_purpose() {
        // Length and CRC-32 of the descriptor in recordings: a change needs a reason and new numbers. Version 0.1.0: 1001,
        // 0xab158d29. Since then: fields 16 and 17 of `Loop`, readings and set-points before a calibration; states 4 and 5, settling
        // and enabling; fields 13, 14 and 18 of `Event`, number, refusal and origin of a request, 15 to 17, the clocks,
        // 19 to 21, the values of `tune`, and 22, the modelled position of a trip.
        let schema = descriptor_set();
        assert_eq!(schema.len(), 1378);
        assert_eq!(crc32fast::hash(&schema), 0x065c_e785);
    }

    /// A message with every field set, by its field numbers on the wire: (number, wire type), with an independent reader.
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
    fn schema_describes_every_field_that_is_written() {
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
            raw_position_m: Some(1.0),
            raw_command_a: Some(1.0),
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
            id: 1,
            refusal: s(),
            loop_ns: 1,
            monotonic_ns: 1,
            wall_ns: 1,
            origin: s(),
            reference_factor: Some(1.0),
            gain_factor: Some(1.0),
            ramp_ticks: 1,
            modelled_m: Some(1.0),
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
        assert_eq!(described(&loop_descriptor()), wire(&tick.encode_to_vec()));
        assert_eq!(
            described(&Event::descriptor()),
            wire(&event.encode_to_vec())
        );
        assert_eq!(
            described(&Timing::descriptor()),
            wire(&timing.encode_to_vec())
        );
    }

    #[test]
    fn doubles_that_equal_zero_are_written() {
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
}
