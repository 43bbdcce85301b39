//! Layers of TOML; a later layer overrides the earlier ones.

use toml::{Table, Value};

use super::ConfigError;
use super::files::EmbeddedFile;
use super::place::line_of;

/// One layer of settings, with the text it came from.
pub struct Layer {
    /// File, profile or flag.
    pub name: String,
    /// The text, in which the line of a key is searched.
    pub text: String,
    /// The settings.
    pub table: Table,
}

impl Layer {
    /// The name of the layer of all `--set`.
    pub const SETS: &str = "--set";

    /// An embedded profile.
    pub fn embedded(profile: EmbeddedFile) -> Result<Layer, ConfigError> {
        Layer::parse(format!("profile {}", profile.name), profile.text.into())
    }

    /// Parses the text of a layer.
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

/// The last of the layers that sets `path`, with the line; or the last layer that sets a table around it.
pub fn place_in(layers: &[Layer], path: &str) -> String {
    let mut path = path;
    loop {
        if let Some(place) = layers.iter().rev().find_map(|layer| layer.place(path)) {
            return place;
        }
        match path.rsplit_once('.') {
            Some((outer, _)) => path = outer,
            None => break,
        }
    }
    let last = layers.last();
    last.map_or("the configuration".into(), |layer| layer.name.clone())
}

/// Merges `over` into `base`: tables that `joins` accepts are merged key by key; everything else replaces the old
/// value.
pub fn overlay(base: &mut Table, over: &Table, joins: fn(&Table, &Table) -> bool) {
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
pub fn same_kind(old: &Table, new: &Table) -> bool {
    ["kind", "model"]
        .iter()
        .all(|tag| match (old.get(*tag), new.get(*tag)) {
            (Some(old), Some(new)) => old == new,
            _ => true,
        })
}
