//! A reader of recordings that uses the schema in the file instead of the types of the program.

use std::path::Path;

use prost::Message;
use prost_types::FileDescriptorSet;
use prost_types::field_descriptor_proto::Type;
use serde_json::{Map, Value, json};

/// The bytes of a recording.
pub struct Recording {
    bytes: Vec<u8>,
}

impl Recording {
    pub fn open(path: &Path) -> Recording {
        Recording {
            bytes: std::fs::read(path).unwrap_or_else(|e| panic!("{}: {e}", path.display())),
        }
    }

    /// All messages of a channel, each as a JSON object.
    pub fn messages(&self, topic: &str) -> Vec<Value> {
        let stream = mcap::MessageStream::new(&self.bytes).expect("a complete MCAP file");
        let messages = stream
            .map(|message| message.expect("a whole message"))
            .filter(|m| m.channel.topic == topic);
        let mut fields = None;
        let decode = |message: mcap::Message| {
            let schema = message.channel.schema.clone().expect("a schema");
            let fields = fields.get_or_insert_with(|| fields_of(&schema.data, &schema.name));
            decoded(&message.data, fields)
        };
        messages.map(decode).collect()
    }

    /// An attachment, as text.
    pub fn attachment(&self, name: &str) -> String {
        let summary = mcap::Summary::read(&self.bytes)
            .expect("readable")
            .expect("a summary, which a closed file has");
        let index = summary
            .attachment_indexes
            .iter()
            .find(|a| a.name == name)
            .expect("the attachment");
        let attachment = mcap::read::attachment(&self.bytes, index).expect("a whole attachment");
        String::from_utf8(attachment.data.into_owned()).expect("UTF-8")
    }
}

struct Field {
    number: u32,
    name: String,
    kind: Type,
}

fn fields_of(descriptor: &[u8], message: &str) -> Vec<Field> {
    let set = FileDescriptorSet::decode(descriptor).expect("a descriptor set");
    let file = &set.file[0];
    let name = message
        .strip_prefix(&format!("{}.", file.package()))
        .expect("a name in the package");
    let message = file
        .message_type
        .iter()
        .find(|m| m.name() == name)
        .expect("the message");
    let field = |f: &prost_types::FieldDescriptorProto| Field {
        number: f.number() as u32,
        name: f.name().to_string(),
        kind: f.r#type(),
    };
    message.field.iter().map(field).collect()
}

/// Decodes the protobuf wire format; a missing field has its default value.
fn decoded(mut data: &[u8], fields: &[Field]) -> Value {
    let default = |field: &Field| match field.kind {
        Type::Double => json!(0.0),
        Type::String => json!(""),
        _ => json!(0),
    };
    let mut object: Map<String, Value> = fields
        .iter()
        .map(|field| (field.name.clone(), default(field)))
        .collect();
    while !data.is_empty() {
        let key = varint(&mut data);
        let field = fields
            .iter()
            .find(|f| u64::from(f.number) == key >> 3)
            .expect("a field of the schema");
        let value = match key & 7 {
            0 => json!(varint(&mut data)),
            1 => json!(f64::from_le_bytes(
                take(&mut data, 8).try_into().expect("eight bytes")
            )),
            2 => {
                let length = varint(&mut data) as usize;
                json!(std::str::from_utf8(take(&mut data, length)).expect("UTF-8"))
            }
            other => panic!("wire type {other}"),
        };
        object.insert(field.name.clone(), value);
    }
    Value::Object(object)
}

fn take<'a>(data: &mut &'a [u8], count: usize) -> &'a [u8] {
    let (taken, rest) = data.split_at(count);
    *data = rest;
    taken
}

fn varint(data: &mut &[u8]) -> u64 {
    let (mut value, mut shift) = (0, 0);
    loop {
        let byte = take(data, 1)[0];
        value |= u64::from(byte & 0x7f) << shift;
        shift += 7;
        if byte < 0x80 {
            return value;
        }
    }
}
