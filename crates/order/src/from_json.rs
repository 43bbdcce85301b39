//! An order from JSON.
//!
//! An order is read in one way only, that of the command line: the options of a JSON object are checked against the schema, written as
//! words, and parsed. What a command line refuses (two options that exclude each other, a number out of its range) JSON refuses with the
//! same message.

use std::borrow::Cow;

use clap::error::ContextKind;
use clap::{Args, FromArgMatches};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::Error as _;
use serde::{Deserialize, Deserializer};
use serde_json::{Map, Value};

use super::order::{Command, Order};
use super::words::{POSITIONAL, field_of, words_of};
use bench_base::nearest::nearest;
use bench_base::remedy;

/// Most words of an order.
const MAX_WORDS: usize = 200;
/// Longest words of an order together, in bytes.
const MAX_BYTES: usize = 16 << 10;

/// A JSON value that is no order.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum OrderError {
    /// No object.
    #[error("an order is an object; give {{\"command\": ..., OPTION: VALUE, ...}}")]
    NoObject,
    /// No command, or an unknown one.
    #[error(
        "`command` is {0}; give one of chirp, control, calibrate, linearity, campaign, identify"
    )]
    Command(String),
    /// The list of arguments of earlier versions.
    #[error(
        "`args` was the form of earlier versions; give each option as a field instead: {{\"command\": \"control\", \"slow\": true, \"duration\": \"60s\", \"set\": [\"loop.rate_hz=5000\"]}} in place of {{\"command\": \"control\", \"args\": [\"--slow\", \"--duration\", \"60s\", ...]}}"
    )]
    Args,
    /// An option that the command does not have.
    #[error("`{field}` is not an option of `{command}`; {remedy}")]
    Unknown {
        /// The field.
        field: String,
        /// The command.
        command: &'static str,
        /// The nearest option, or where they are listed.
        remedy: String,
    },
    /// A value of another type.
    #[error("`{field}` is {value}; give {needed}")]
    Type {
        /// The field.
        field: String,
        /// The value.
        value: String,
        /// The type.
        needed: &'static str,
    },
    /// Too many words, or too long.
    #[error(
        "an order has at most {MAX_WORDS} values of together at most {MAX_BYTES} bytes, without a zero byte; shorten it"
    )]
    TooLong,
    /// The parser of the command line refuses it.
    #[error("{message}")]
    Refused {
        /// What is wrong and what to do.
        message: String,
        /// The option that is wrong, if there is one.
        option: Option<String>,
    },
}

impl From<clap::Error> for OrderError {
    fn from(error: clap::Error) -> OrderError {
        OrderError::Refused {
            message: usage_message(&error),
            option: refused_option(&error),
        }
    }
}

impl OrderError {
    /// The field that is wrong, as in the JSON object of the order; `None` if it is not a single one.
    pub fn field(&self) -> Option<String> {
        match self {
            OrderError::Command(_) => Some("command".into()),
            OrderError::Args => Some("args".into()),
            OrderError::Unknown { field, .. } | OrderError::Type { field, .. } => {
                Some(field.clone())
            }
            OrderError::Refused { option, .. } => option.as_deref().map(field_of),
            OrderError::NoObject | OrderError::TooLong => None,
        }
    }
}

/// The option that a parser refuses, if there is one.
pub fn refused_option(error: &clap::Error) -> Option<String> {
    let argument = error.get(ContextKind::InvalidArg);
    argument.map(|argument| argument.to_string())
}

/// The first paragraph of the parser's message, on one line and with a remedy: the messages of our own value parsers have
/// one already.
pub fn usage_message(error: &clap::Error) -> String {
    let text = error.to_string();
    let paragraph = text.split("\n\n").next().unwrap_or_default();
    let words: Vec<&str> = paragraph.split_whitespace().collect();
    let what = words.join(" ");
    let what = what.strip_prefix("error: ").unwrap_or(&what);
    let suggestions = [
        ContextKind::SuggestedArg,
        ContextKind::SuggestedSubcommand,
        ContextKind::SuggestedValue,
    ];
    let suggested = suggestions.into_iter().find_map(|kind| error.get(kind));
    match (remedy::split(what).1, suggested) {
        (Some(_), _) => what.to_string(),
        (None, Some(suggested)) => remedy::join(what, &format!("use {suggested}, or see --help")),
        (None, None) => remedy::join(what, "see --help for the arguments"),
    }
}

impl Order {
    /// Reads an order from a JSON object.
    ///
    /// # Errors
    /// When it is no order; the message says which option is wrong.
    pub fn from_json(value: Value) -> Result<Order, OrderError> {
        let Value::Object(mut fields) = value else {
            return Err(OrderError::NoObject);
        };
        let command = command(fields.shift_remove("command"))?;
        check_fields(command, &fields)?;
        let words = words_of(&fields);
        check_length(&words)?;
        Ok(parse(command, &words)?)
    }
}

fn command(value: Option<Value>) -> Result<Command, OrderError> {
    let Some(value) = value else {
        return Err(OrderError::Command("missing".into()));
    };
    let command = Command::deserialize(&value);
    command.map_err(|_| OrderError::Command(format!("{value}")))
}

/// Parses the words of a command line after the name of the command.
fn parse(command: Command, words: &[String]) -> Result<Order, clap::Error> {
    Ok(match command {
        Command::Chirp => Order::Chirp(options(words)?),
        Command::Control => Order::Control(Box::new(options(words)?)),
        Command::Calibrate => Order::Calibrate(options(words)?),
        Command::Linearity => Order::Linearity(options(words)?),
        Command::Campaign => Order::Campaign(options(words)?),
        Command::Identify => Order::Identify(options(words)?),
    })
}

fn options<T: Args + FromArgMatches>(words: &[String]) -> Result<T, clap::Error> {
    let parser = T::augment_args(clap::Command::new("order"));
    let parser = parser.no_binary_name(true).disable_help_flag(true);
    T::from_arg_matches(&parser.try_get_matches_from(words)?)
}

fn check_length(words: &[String]) -> Result<(), OrderError> {
    let bytes: usize = words.iter().map(String::len).sum();
    let has_zero = words.iter().any(|word| word.contains('\0'));
    if words.len() > MAX_WORDS || bytes > MAX_BYTES || has_zero {
        Err(OrderError::TooLong)
    } else {
        Ok(())
    }
}

/// Refuses fields that are not options of the command, and values of another type.
fn check_fields(command: Command, fields: &Map<String, Value>) -> Result<(), OrderError> {
    let schema = command.options_schema(&mut SchemaGenerator::default());
    let known = schema.get("properties").and_then(Value::as_object);
    let known = known.cloned().unwrap_or_default();
    if fields.contains_key("args") {
        return Err(OrderError::Args);
    }
    for (field, value) in fields {
        let option = known
            .get(field)
            .ok_or_else(|| unknown(command, field, &known))?;
        let kind = ValueKind::of(option);
        if !kind.has(value) {
            return Err(OrderError::Type {
                field: field.clone(),
                value: value.to_string(),
                needed: kind.text(),
            });
        }
    }
    Ok(())
}

fn unknown(command: Command, field: &str, known: &Map<String, Value>) -> OrderError {
    let names = known.keys().map(String::as_str);
    let remedy = match nearest(field, names) {
        Some(name) => format!("use `{name}`"),
        None => format!(
            "the fields are the options of `bench {} --help`, with `_` for `-`",
            command.name()
        ),
    };
    OrderError::Unknown {
        field: field.into(),
        command: command.name(),
        remedy,
    }
}

/// The JSON type of an option.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ValueKind {
    Switch,
    Number,
    Text,
    Texts,
}

impl ValueKind {
    /// The type that a schema states. Words such as the kind of an excitation are a reference to a list of texts.
    fn of(schema: &Value) -> ValueKind {
        let is = |name: &str| match &schema["type"] {
            Value::String(own) => own == name,
            Value::Array(own) => own.iter().any(|own| own == name),
            _ => false,
        };
        if is("boolean") {
            ValueKind::Switch
        } else if is("integer") {
            ValueKind::Number
        } else if is("array") {
            ValueKind::Texts
        } else {
            ValueKind::Text
        }
    }

    fn has(self, value: &Value) -> bool {
        match self {
            ValueKind::Switch => value.is_boolean(),
            ValueKind::Number => value.is_null() || value.is_u64(),
            ValueKind::Text => value.is_null() || value.is_string(),
            ValueKind::Texts => {
                let values = value.as_array();
                values.is_some_and(|values| values.iter().all(Value::is_string))
            }
        }
    }

    fn text(self) -> &'static str {
        match self {
            ValueKind::Switch => "true or false",
            ValueKind::Number => "a whole number",
            ValueKind::Text => "a text",
            ValueKind::Texts => "a list of texts",
        }
    }
}

impl<'de> Deserialize<'de> for Order {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Order, D::Error> {
        let value = Value::deserialize(deserializer)?;
        Order::from_json(value).map_err(D::Error::custom)
    }
}

impl JsonSchema for Order {
    fn schema_name() -> Cow<'static, str> {
        "Order".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        order_schema(generator, &Map::new())
    }
}

/// The schema of an order that has more fields beside its options.
pub fn order_schema(generator: &mut SchemaGenerator, more: &Map<String, Value>) -> Schema {
    let variants = Command::ALL.iter();
    let variants: Vec<Value> = variants
        .map(|command| variant(*command, generator, more))
        .collect();
    json_schema!({ "oneOf": variants })
}

/// The object of one command.
fn variant(command: Command, generator: &mut SchemaGenerator, more: &Map<String, Value>) -> Value {
    let mut options = command.options_schema(generator);
    let mut properties = Map::new();
    properties.insert(
        "command".into(),
        serde_json::json!({ "const": command.name() }),
    );
    if let Some(Value::Object(options)) = options.remove("properties") {
        properties.extend(options);
    }
    properties.extend(more.clone());
    let mut schema = serde_json::json!({
        "type": "object",
        "title": command.name(),
        "description": command.description(),
        "properties": properties,
        "required": ["command"],
        "additionalProperties": false,
    });
    if command == Command::Identify {
        let files = [POSITIONAL, "frf"].map(|file| serde_json::json!({ "required": [file] }));
        schema["oneOf"] = Value::from(files.to_vec());
    }
    schema
}
