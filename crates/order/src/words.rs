//! The words of a command line for options in JSON.

use serde_json::{Map, Value};

/// The argument without an option.
pub(crate) const POSITIONAL: &str = "recording";

/// The words of options in JSON.
pub(crate) fn words_of(fields: &Map<String, Value>) -> Vec<String> {
    let options = fields.iter().filter(|(field, _)| *field != POSITIONAL);
    let mut words: Vec<String> = options
        .flat_map(|(field, value)| option_words(&field.replace('_', "-"), value))
        .collect();
    if let Some(Value::String(file)) = fields.get(POSITIONAL) {
        words.extend(["--".to_string(), file.clone()]);
    }
    words
}

/// The field in JSON of an option as a parser names it: `--operating-point <LENGTH>` is `operating_point`.
pub(crate) fn field_of(option: &str) -> String {
    let word = option.split([' ', ',', '=']).next().unwrap_or_default();
    match word.strip_prefix("--") {
        Some(name) => name.replace('-', "_"),
        None => word.trim_matches(['<', '>', '[', ']']).to_lowercase(),
    }
}

fn option_words(option: &str, value: &Value) -> Vec<String> {
    match value {
        Value::Null | Value::Bool(false) | Value::Object(_) => Vec::new(),
        Value::Bool(true) => vec![format!("--{option}")],
        Value::Number(number) => vec![format!("--{option}={number}")],
        Value::String(text) => vec![format!("--{option}={text}")],
        Value::Array(values) => {
            let words = values.iter();
            words
                .flat_map(|value| option_words(option, value))
                .collect()
        }
    }
}
