//! Settings made on the command line: `--set KEY=VALUE`, and the options for single settings.

use std::ops::RangeInclusive;

use serde_json::Value as Json;
use toml::{Table, Value};

use bench_base::finding::Finding;
use bench_base::quantity::{Dimension, Quantity};
use bench_settings::ConfigError;
use bench_settings::check;
use bench_settings::layer::{Layer, overlay, same_kind};

/// Largest number of parts of a key. The deepest key of a configuration has 5.
const MAX_KEY_PARTS: usize = 32;
/// The key that states what the other keys of a table are.
const KIND: &str = "kind";

/// A setting that a command-line option sets. Errors name the option as typed, not the setting.
#[derive(Clone, Debug, PartialEq)]
pub struct OptionSetting {
    key: String,
    value: Value,
    option: String,
}

impl OptionSetting {
    /// The setting `key` made by `option`, which is its text on the command line: `--amplitude 0.1A`.
    pub fn new(
        key: impl Into<String>,
        value: impl Into<Value>,
        option: impl Into<String>,
    ) -> OptionSetting {
        OptionSetting {
            key: key.into(),
            value: value.into(),
            option: option.into(),
        }
    }

    /// Whether `path` is the setting or something within it.
    fn contains(&self, path: &str) -> bool {
        let rest = path.strip_prefix(&self.key);
        rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    }

    /// Whether it is a table in which `--set` states `path`.
    fn is_changed_by(&self, sets: Option<&Table>, path: &str) -> bool {
        self.value.is_table() && sets.is_some_and(|sets| at(sets, path).is_some())
    }

    /// The contradiction of a table that `--set` gives another kind.
    fn other_kind(&self, set: Option<&Value>) -> Option<Finding> {
        let set = set?.get(KIND)?;
        let is_other = self.value.get(KIND).is_some_and(|kind| kind != set);
        let path = check::join(&self.key, KIND);
        let what = format!("contradicts `--set {path}={set}`, leave one of them out");
        is_other.then(|| Finding::new(&self.key, what))
    }

    /// ` (did you mean 8mm?)` for a number without a unit that would be allowed with one.
    fn hint(&self, path: &str, schema: &Json, merged: &Value) -> String {
        let number = self.option.rsplit(' ').next();
        let number = number.and_then(|text| text.parse::<f64>().ok());
        let (Some(number), Some(allowed)) = (number, check::range_at(schema, merged, path)) else {
            return String::new();
        };
        if allowed.contains(&number) {
            return String::new();
        }
        match readings(number, path, &allowed).as_slice() {
            [] => String::new(),
            readings => format!(" (did you mean {}?)", readings.join(" or ")),
        }
    }
}

/// Up to two quantities with units that the user may have meant.
fn readings(number: f64, path: &str, allowed: &RangeInclusive<f64>) -> Vec<String> {
    let mut readings = Dimension::of_key(path).other_readings(number, allowed);
    if path == Quantity::OPERATING_POINT && number.abs() <= 100.0 {
        readings.insert(0, format!("{number}%"));
    }
    readings.truncate(2);
    readings
}

/// Merges the options into the layers. The table of an option (`--reference sine`) contains default values, so `--set` changes them;
/// an option for a single value (`--amplitude 20um`) is over `--set`. Another kind in `--set` contradicts the option.
pub(super) fn overlay_options(
    merged: &mut Table,
    sets: Option<&Table>,
    options: &[OptionSetting],
) -> Vec<Finding> {
    let (tables, values): (Vec<_>, Vec<_>) =
        options.iter().partition(|option| option.value.is_table());
    overlay(merged, &options_table(&tables), same_kind);
    let mut findings = Vec::new();
    for option in tables {
        let set = sets.and_then(|sets| at(sets, &option.key));
        match (set, option.other_kind(set)) {
            (_, Some(finding)) => findings.push(finding),
            (Some(set), None) => overlay_at(merged, &option.key, set.clone()),
            (None, None) => {}
        }
    }
    overlay(merged, &options_table(&values), same_kind);
    findings
}

/// The settings of the options as a layer.
fn options_table(options: &[&OptionSetting]) -> Table {
    let mut table = Table::new();
    for option in options {
        overlay_at(&mut table, &option.key, option.value.clone());
    }
    table
}

/// The value at a key of several parts.
fn at<'a>(table: &'a Table, key: &str) -> Option<&'a Value> {
    let (outer, last) = match key.rsplit_once('.') {
        Some((outer, last)) => (at(table, outer)?.as_table()?, last),
        None => (table, key),
    };
    outer.get(last)
}

/// The error of a setting in terms of the option that made the setting, if there is one. What `--set` changed in the table of an
/// option is not made by the option.
pub(super) fn in_terms_of_option(
    options: &[OptionSetting],
    sets: Option<&Table>,
    finding: &Finding,
    schema: &Json,
    merged: &Value,
) -> Option<String> {
    let around = options
        .iter()
        .filter(|option| option.contains(&finding.path))
        .filter(|option| option.key == finding.path || !option.is_changed_by(sets, &finding.path));
    let option = around.max_by_key(|option| option.key.len())?;
    let hint = option.hint(&finding.path, schema, merged);
    Some(format!("  {} {}{hint}", option.option, finding.what))
}

/// All `--set KEY=VALUE` as one layer. A value that is not TOML is text: `control.controller=slow`.
pub(super) fn sets(sets: &[String]) -> Result<Layer, ConfigError> {
    let mut table = Table::new();
    for set in sets {
        let (key, value) = key_and_value(set).map_err(|why| ConfigError::Assignment {
            text: set.clone(),
            why,
        })?;
        overlay_at(&mut table, key, value);
    }
    let text = toml::to_string(&table).unwrap_or_default();
    Ok(Layer {
        name: Layer::SETS.into(),
        text,
        table,
    })
}

/// All texts in the value of `KEY=VALUE`, as a configuration reads them; none if it is no such assignment.
pub fn texts_of_set(set: &str) -> Vec<String> {
    let mut texts = Vec::new();
    if let Ok((_, value)) = key_and_value(set) {
        texts_in(&value, &mut texts);
    }
    texts
}

fn texts_in(value: &Value, texts: &mut Vec<String>) {
    match value {
        Value::String(text) => texts.push(text.clone()),
        Value::Array(items) => items.iter().for_each(|item| texts_in(item, texts)),
        Value::Table(table) => table.values().for_each(|item| texts_in(item, texts)),
        Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Datetime(_) => {}
    }
}

fn key_and_value(set: &str) -> Result<(&str, Value), &'static str> {
    let split = set.split_once('=');
    let (key, text) = split.ok_or("there is no `=`")?;
    let (key, text) = (key.trim(), text.trim());
    if key.split('.').any(str::is_empty) {
        return Err("the key has an empty part");
    }
    if key.split('.').count() > MAX_KEY_PARTS {
        return Err("the key has more than 32 parts");
    }
    if text.contains(['\n', '\r']) {
        return Err("the value has more than one line");
    }
    let table = format!("value = {text}").parse::<Table>().ok();
    let value = table.and_then(|mut table| table.remove("value"));
    let value = value.unwrap_or_else(|| text.trim_matches('"').into());
    Ok((key, value))
}

fn overlay_at(table: &mut Table, key: &str, value: Value) {
    let nested = key.rsplit('.').fold(value, |inner, part| {
        Value::Table(Table::from_iter([(part.to_string(), inner)]))
    });
    if let Value::Table(nested) = nested {
        overlay(table, &nested, |_, _| true);
    }
}

/// Converts the quantities with units among the values of `--set` to numbers, if a number is expected and no option replaced them.
pub(super) fn convert_quantities(schema: &Json, sets: &Table, merged: &mut Table) -> Vec<Finding> {
    let mut texts = Vec::new();
    collect_texts(sets, "", &mut texts);
    let tree = Value::Table(merged.clone());
    texts.retain(|(path, text)| {
        let is_used = at(merged, path).and_then(Value::as_str) == Some(text);
        is_used && check::expects_number(schema, &tree, path)
    });
    let mut findings = Vec::new();
    for (path, text) in texts {
        let Ok(quantity) = text.parse::<Quantity>() else {
            continue;
        };
        match quantity.for_setting(&path, beam_length_m(merged)) {
            Ok(si) => overlay_at(merged, &path, Value::Float(si)),
            Err(error) => findings.push(Finding::new(&path, format!("cannot be set: {error}"))),
        }
    }
    findings
}

fn collect_texts(table: &Table, around: &str, texts: &mut Vec<(String, String)>) {
    for (key, value) in table {
        let path = check::join(around, key);
        match value {
            Value::Table(inner) => collect_texts(inner, &path, texts),
            Value::String(text) => texts.push((path, text.clone())),
            _ => {}
        }
    }
}

fn beam_length_m(merged: &Table) -> Option<f64> {
    merged.get("plant")?.get("beam_length_m")?.as_float()
}
