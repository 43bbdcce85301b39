//! Checks a merged TOML tree against the schema made from the types: unknown keys with the nearest valid one, missing
//! keys, types and ranges, each with its path.

use std::ops::RangeInclusive;

use serde_json::{Map, Value as Json};
use toml::{Table, Value};

use super::renamed::new_name;
use crate::util::finding::Finding;
use crate::util::nearest::nearest;
use crate::util::quantity::{Dimension, Quantity};

/// All that is wrong with `value`.
pub(super) fn check(schema: &Json, value: &Value) -> Vec<Finding> {
    let mut findings = Findings(Vec::new());
    node(schema, schema, value, "", &mut findings);
    findings.0
}

/// Whether a number belongs at `path` of `value`.
pub(super) fn wants_number(schema: &Json, value: &Value, path: &str) -> bool {
    keywords_at(schema, value, path).is_some_and(|keywords| is(&keywords, "number"))
}

/// The range of a number at `path` of `value`.
pub(super) fn range_at(schema: &Json, value: &Value, path: &str) -> Option<RangeInclusive<f64>> {
    let keywords = keywords_at(schema, value, path)?;
    let limit = |key: &str| keywords.get(key).and_then(Json::as_f64);
    Some(limit("minimum")?..=limit("maximum")?)
}

/// The keywords of the schema for what is at `path` of `value`.
fn keywords_at(schema: &Json, value: &Value, path: &str) -> Option<Map<String, Json>> {
    let mut keywords = flatten(schema, schema);
    let mut value = value;
    for part in path.split('.') {
        if let Some(variants) = keywords.get("oneOf").and_then(Json::as_array) {
            let tag = variants.iter().find_map(tag_of)?;
            keywords = flatten(schema, chosen(variants, &tag, value)?);
        }
        let index = part.parse::<usize>().ok();
        let property = keywords.get("properties").and_then(|all| all.get(part));
        let named = keywords.get("additionalProperties");
        let item = index.and_then(|_| keywords.get("items"));
        let inner = property.or(item).or(named)?.clone();
        keywords = flatten(schema, &inner);
        let entry = value.get(part);
        value = entry.or_else(|| value.get(index?))?;
    }
    Some(keywords)
}

struct Findings(Vec<Finding>);

impl Findings {
    fn add(&mut self, path: &str, what: String) {
        self.0.push(Finding::new(path, what));
    }

    fn lacks(&mut self, path: &str, what: String) {
        self.0.push(Finding {
            path: path.to_string(),
            what,
            missing: true,
        });
    }
}

fn node(root: &Json, schema: &Json, value: &Value, path: &str, out: &mut Findings) {
    let keywords = flatten(root, schema);
    if let Some(variants) = keywords.get("oneOf").and_then(Json::as_array) {
        return variant(root, variants, value, path, out);
    }
    match value {
        Value::Table(entries) if is(&keywords, "object") => {
            table(root, &keywords, entries, path, out)
        }
        Value::Array(items) if is(&keywords, "array") => array(root, &keywords, items, path, out),
        Value::Integer(n) if is(&keywords, "integer") || is(&keywords, "number") => {
            range(&keywords, *n as f64, path, out);
        }
        Value::Float(x) if is(&keywords, "number") => range(&keywords, *x, path, out),
        Value::String(word) if is(&keywords, "string") => text(&keywords, word, path, out),
        Value::Boolean(_) if is(&keywords, "boolean") => {}
        other => out.add(path, wrong_type(&keywords, other, path)),
    }
}

/// The keywords of a node together with those of what it refers to.
fn flatten(root: &Json, schema: &Json) -> Map<String, Json> {
    let mut keywords = schema.as_object().cloned().unwrap_or_default();
    let target = schema
        .get("$ref")
        .and_then(Json::as_str)
        .and_then(|r| root.pointer(r.strip_prefix('#')?));
    for (key, value) in target
        .map(|target| flatten(root, target))
        .unwrap_or_default()
    {
        match (keywords.get_mut(&key), value) {
            (Some(Json::Object(mine)), Json::Object(theirs)) => mine.extend(theirs),
            (Some(Json::Array(mine)), Json::Array(theirs)) => mine.extend(theirs),
            (Some(_), _) => {}
            (None, value) => {
                keywords.insert(key, value);
            }
        }
    }
    keywords
}

/// One of several tables told apart by a constant tag, or one of several words.
fn variant(root: &Json, variants: &[Json], value: &Value, path: &str, out: &mut Findings) {
    let Some(tag) = variants.iter().find_map(tag_of) else {
        let words: Vec<&str> = variants.iter().filter_map(constant).collect();
        if !value.as_str().is_some_and(|word| words.contains(&word)) {
            out.add(path, not_one_of(&value.to_string(), &words));
        }
        return;
    };
    match chosen(variants, &tag, value) {
        Some(chosen) => node(root, chosen, value, path, out),
        None => {
            let words: Vec<&str> = variants
                .iter()
                .filter_map(|v| constant(&v["properties"][&tag]))
                .collect();
            match value.get(&tag) {
                Some(given) => out.add(&join(path, &tag), not_one_of(&given.to_string(), &words)),
                None => out.lacks(&join(path, &tag), not_one_of("missing", &words)),
            }
        }
    }
}

/// The variant that the tag of a table names.
fn chosen<'a>(variants: &'a [Json], tag: &str, value: &Value) -> Option<&'a Json> {
    let word = value.get(tag)?.as_str()?;
    let named = |variant: &&Json| constant(&variant["properties"][tag]) == Some(word);
    variants.iter().find(named)
}

fn table(
    root: &Json,
    keywords: &Map<String, Json>,
    entries: &Table,
    path: &str,
    out: &mut Findings,
) {
    let none = Map::new();
    let properties = keywords
        .get("properties")
        .and_then(Json::as_object)
        .unwrap_or(&none);
    // A table of entries with names of the user's own has one schema for all of them.
    let named = keywords
        .get("additionalProperties")
        .filter(|schema| schema.is_object());
    for (key, value) in entries {
        match properties.get(key).or(named) {
            Some(schema) => node(root, schema, value, &join(path, key), out),
            None => unknown_key(path, key, properties, out),
        }
    }
    let required = keywords
        .get("required")
        .and_then(Json::as_array)
        .into_iter()
        .flatten();
    for key in required
        .filter_map(Json::as_str)
        .filter(|key| !entries.contains_key(*key))
    {
        out.lacks(
            &join(path, key),
            "is missing; this kind of table needs it".into(),
        );
    }
}

fn array(
    root: &Json,
    keywords: &Map<String, Json>,
    items: &[Value],
    path: &str,
    out: &mut Findings,
) {
    let least = keywords.get("minItems").and_then(Json::as_u64).unwrap_or(0);
    let most = keywords
        .get("maxItems")
        .and_then(Json::as_u64)
        .unwrap_or(u64::MAX);
    if !(least..=most).contains(&(items.len() as u64)) {
        out.add(
            path,
            format!("has {} entries; {least} to {most} are allowed", items.len()),
        );
    }
    for (index, item) in items.iter().enumerate() {
        if let Some(schema) = keywords.get("items") {
            node(root, schema, item, &join(path, &index.to_string()), out);
        }
    }
}

fn range(keywords: &Map<String, Json>, x: f64, path: &str, out: &mut Findings) {
    let limit = |key: &str| keywords.get(key).and_then(Json::as_f64);
    let (low, high) = (limit("minimum"), limit("maximum"));
    if !x.is_finite() || low.is_some_and(|low| x < low) || high.is_some_and(|high| x > high) {
        let bound = |b: Option<f64>| b.map_or("any".to_string(), |b| format!("{b}"));
        let dimension = Dimension::of_key(path);
        let (is, unit) = (dimension.display(x), dimension.si_unit());
        let allowed = format!("{} to {} {unit}", bound(low), bound(high));
        out.add(path, format!("is {is}; allowed is {}", allowed.trim_end()));
    }
}

fn text(keywords: &Map<String, Json>, word: &str, path: &str, out: &mut Findings) {
    let words: Vec<&str> = keywords
        .get("enum")
        .and_then(Json::as_array)
        .into_iter()
        .flatten()
        .filter_map(Json::as_str)
        .collect();
    if !words.is_empty() && !words.contains(&word) {
        out.add(path, not_one_of(&format!("{word:?}"), &words));
    }
}

pub(super) fn join(path: &str, key: &str) -> String {
    if path.is_empty() {
        key.to_string()
    } else {
        format!("{path}.{key}")
    }
}

fn is(keywords: &Map<String, Json>, kind: &str) -> bool {
    match keywords.get("type") {
        Some(Json::String(one)) => one == kind,
        Some(Json::Array(several)) => several.iter().any(|one| one == kind),
        _ => false,
    }
}

fn constant(schema: &Json) -> Option<&str> {
    schema.get("const").and_then(Json::as_str)
}

/// The property that holds a constant in this variant.
fn tag_of(variant: &Json) -> Option<String> {
    let properties = variant.get("properties")?.as_object()?;
    properties
        .iter()
        .find(|(_, schema)| constant(schema).is_some())
        .map(|(key, _)| key.clone())
}

fn unknown_key(path: &str, key: &str, properties: &Map<String, Json>, out: &mut Findings) {
    let path = join(path, key);
    let nearest = nearest(key, properties.keys().map(String::as_str));
    let what = match (new_name(&path), nearest) {
        (Some(new), _) => format!("is an earlier name; it is called `{new}` now"),
        (None, Some(nearest)) => format!("is not a setting; the nearest is `{nearest}`"),
        (None, None) => "is not a setting; this table has none".into(),
    };
    out.add(&path, what);
}

fn not_one_of(given: &str, words: &[&str]) -> String {
    format!("is {given}; allowed is {}", words.join(", "))
}

fn wrong_type(keywords: &Map<String, Json>, given: &Value, path: &str) -> String {
    let wanted = ["number", "integer", "string", "boolean", "array", "object"]
        .into_iter()
        .find(|t| is(keywords, t));
    let wanted = wanted.map_or(
        "something else",
        |t| if t == "object" { "table" } else { t },
    );
    let quantity: Option<Quantity> = given.as_str().and_then(|text| text.parse().ok());
    match quantity.filter(|_| wanted == "number") {
        Some(quantity) => {
            let si = quantity.si(Dimension::of_key(path));
            let remedy = si.map_or_else(|error| error.to_string(), |x| format!("write {x}"));
            format!("is the text {given}, not a number; settings are in SI units: {remedy}")
        }
        None => {
            let article = if wanted.starts_with(['a', 'i']) {
                "an"
            } else {
                "a"
            };
            format!(
                "is {given}, {} where {article} {wanted} belongs",
                given.type_str()
            )
        }
    }
}
