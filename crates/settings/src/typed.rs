//! One TOML text as a value of one type.

use schemars::JsonSchema;
use serde::de::DeserializeOwned;
use toml::Value;

use crate::check::check;
use crate::error::{ConfigError, MAX_ERRORS};
use crate::layer::{Layer, place_in};

/// Parses TOML of any type and checks it against the schema of the type. `name` is the file or the source of the text.
pub fn typed<T: DeserializeOwned + JsonSchema>(name: &str, text: &str) -> Result<T, ConfigError> {
    let layer = Layer::parse(name.to_string(), text.to_string())?;
    let schema = schemars::schema_for!(T).to_value();
    let value = Value::Table(layer.table.clone());
    let layers = std::slice::from_ref(&layer);
    let mut lines = Vec::new();
    for finding in check(&schema, &value, &[]).iter().take(MAX_ERRORS) {
        let place = place_in(layers, finding.at());
        lines.push(format!("  {place}: `{}` {}", finding.path, finding.what));
    }
    ConfigError::unless_empty(lines)?;
    let typed: Result<T, toml::de::Error> = value.try_into();
    typed.map_err(|e| ConfigError::Refused(vec![format!("  {name}: {e}")]))
}
