//! Layers of TOML; a later layer overrides the earlier ones.

use toml::{Table, Value};

use super::ConfigError;
use super::place::line_of;
use super::profiles::EmbeddedFile;

/// One layer of settings, with the text it came from.
pub(super) struct Layer {
    pub name: String,
    pub text: String,
    pub table: Table,
}

impl Layer {
    /// The name of the layer of all `--set`.
    pub const SETS: &str = "--set";

    /// An embedded profile.
    pub fn embedded(profile: EmbeddedFile) -> Result<Layer, ConfigError> {
        Layer::parse(format!("profile {}", profile.name), profile.text.into())
    }

    pub fn parse(name: String, text: String) -> Result<Layer, ConfigError> {
        match text.parse::<Table>() {
            Ok(table) => Ok(Layer { name, text, table }),
            Err(e) => Err(ConfigError::Syntax {
                place: name,
                why: e.to_string(),
            }),
        }
    }

    /// Name of the layer and line of `path`, if the layer sets it.
    pub fn place(&self, path: &str) -> Option<String> {
        let line = line_of(&self.text, path)?;
        Some(match self.name.as_str() {
            Layer::SETS => self.name.clone(),
            name => format!("{name} line {line}"),
        })
    }
}

/// Merges `over` into `base`: tables that `joins` accepts are merged key by key; everything else replaces the old
/// value.
pub(super) fn overlay(base: &mut Table, over: &Table, joins: fn(&Table, &Table) -> bool) {
    for (key, value) in over {
        match (base.get_mut(key), value) {
            (Some(Value::Table(old)), Value::Table(new)) if joins(old, new) => {
                overlay(old, new, joins)
            }
            _ => {
                base.insert(key.clone(), value.clone());
            }
        }
    }
}

/// Whether two tables have the same `kind` and `model`. Tables of different kinds have different keys and are not merged.
pub(super) fn same_kind(old: &Table, new: &Table) -> bool {
    ["kind", "model"]
        .iter()
        .all(|tag| match (old.get(*tag), new.get(*tag)) {
            (Some(old), Some(new)) => old == new,
            _ => true,
        })
}
