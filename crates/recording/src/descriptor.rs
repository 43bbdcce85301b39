//! Descriptors of protobuf messages and enumerations.

use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{
    DescriptorProto, EnumDescriptorProto, EnumValueDescriptorProto, FieldDescriptorProto,
    OneofDescriptorProto,
};

/// A message of fields by number, name, type, and whether the field may be absent.
pub(super) fn message(name: &str, fields: &[(&str, &str, (Type, bool))]) -> DescriptorProto {
    let mut message = DescriptorProto {
        name: Some(name.into()),
        ..DescriptorProto::default()
    };
    for (number, name, (kind, is_optional)) in fields {
        let mut field = field(number, name, *kind);
        if *is_optional {
            // A proto3 `optional` is described as a oneof of one field.
            field.proto3_optional = Some(true);
            field.oneof_index = Some(message.oneof_decl.len() as i32);
            message.oneof_decl.push(OneofDescriptorProto {
                name: Some(format!("_{name}")),
                options: None,
            });
        }
        message.field.push(field);
    }
    message
}

fn field(number: &str, name: &str, kind: Type) -> FieldDescriptorProto {
    FieldDescriptorProto {
        name: Some(name.into()),
        number: number.parse().ok(),
        label: Some(Label::Optional.into()),
        r#type: Some(kind.into()),
        ..FieldDescriptorProto::default()
    }
}

/// An enumeration whose values are numbered from 0 in the given order.
pub(super) fn enumeration<const N: usize>(name: &str, values: [&str; N]) -> EnumDescriptorProto {
    let value = |(number, name): (i32, &str)| EnumValueDescriptorProto {
        name: Some(name.into()),
        number: Some(number),
        ..EnumValueDescriptorProto::default()
    };
    EnumDescriptorProto {
        name: Some(name.into()),
        value: (0..).zip(values).map(value).collect(),
        ..EnumDescriptorProto::default()
    }
}
