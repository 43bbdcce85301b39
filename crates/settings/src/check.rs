//! Checks a merged TOML tree against the schema made from the types: unknown keys with the nearest valid one, missing
//! keys, types and ranges, each with its path.

use std::ops::RangeInclusive;

use serde_json::{Map, Value as Json};
use toml::{Table, Value};

use bench_base::finding::Finding;
use bench_base::nearest::nearest;
use bench_base::quantity::{Dimension, Quantity};

/// Old path and new key of the settings that were renamed.
pub type RenamedKeys = &'static [(&'static str, &'static str)];

/// The errors in `value`. An unknown key that is in `renamed` is refused with its new name.
pub fn check(schema: &Json, value: &Value, renamed: RenamedKeys) -> Vec<Finding> {
    let mut checker = Checker {
        root: schema,
        renamed,
        findings: Vec::new(),
    };
    checker.node(schema, value, "");
    checker.findings
}

/// Whether the schema expects a number at `path` of `value`.
pub fn expects_number(schema: &Json, value: &Value, path: &str) -> bool {
    keywords_at(schema, value, path).is_some_and(|keywords| keywords.is("number"))
}

/// The range of a number at `path` of `value`.
pub fn range_at(schema: &Json, value: &Value, path: &str) -> Option<RangeInclusive<f64>> {
    let keywords = keywords_at(schema, value, path)?;
    Some(keywords.number("minimum")?..=keywords.number("maximum")?)
}

/// The keywords of the schema for the entry at `path` of `value`.
fn keywords_at(schema: &Json, value: &Value, path: &str) -> Option<Keywords> {
    let mut keywords = Keywords::of(schema, schema);
    let mut value = value;
    for part in path.split('.') {
        if let Some(variants) = keywords.list("oneOf") {
            let tag = variants.iter().find_map(tag_of)?;
            keywords = Keywords::of(schema, chosen(variants, &tag, value)?);
        }
        keywords = Keywords::of(schema, keywords.inner(part)?);
        let index = || part.parse::<usize>().ok();
        value = value.get(part).or_else(|| value.get(index()?))?;
    }
    Some(keywords)
}

/// The keywords of a schema, together with those of the schema that it refers to.
struct Keywords(Map<String, Json>);

impl Keywords {
    fn of(root: &Json, schema: &Json) -> Keywords {
        let mut keywords = schema.as_object().cloned().unwrap_or_default();
        let reference = schema.get("$ref").and_then(Json::as_str);
        let target = reference.and_then(|path| root.pointer(path.strip_prefix('#')?));
        for (key, value) in target
            .map(|target| Keywords::of(root, target).0)
            .into_iter()
            .flatten()
        {
            match (keywords.get_mut(&key), value) {
                (Some(Json::Object(mine)), Json::Object(theirs)) => mine.extend(theirs),
                (Some(Json::Array(mine)), Json::Array(theirs)) => mine.extend(theirs),
                (Some(_), _) => {}
                (None, value) => drop(keywords.insert(key, value)),
            }
        }
        Keywords(keywords)
    }

    /// The schema of the entry `part` of a table or an array.
    fn inner(&self, part: &str) -> Option<&Json> {
        let property = self.0.get("properties").and_then(|all| all.get(part));
        let is_index = part.parse::<usize>().is_ok();
        let item = self.0.get("items").filter(|_| is_index);
        property.or(item).or(self.0.get("additionalProperties"))
    }

    /// Whether a value of this type is allowed.
    fn is(&self, kind: &str) -> bool {
        match self.0.get("type") {
            Some(Json::String(one)) => one == kind,
            Some(Json::Array(several)) => several.iter().any(|one| one == kind),
            _ => false,
        }
    }

    fn number(&self, key: &str) -> Option<f64> {
        self.0.get(key)?.as_f64()
    }

    fn list(&self, key: &str) -> Option<&Vec<Json>> {
        self.0.get(key)?.as_array()
    }

    /// The strings in a list; none if there is no list.
    fn words(&self, key: &str) -> Vec<&str> {
        let list = self.list(key).into_iter().flatten();
        list.filter_map(Json::as_str).collect()
    }
}

/// The table of a kind that another program registers.
const NO_KIND: &str = "belongs to a kind that this program does not know; use the program that registers the kind (docs/own-bench.md), or remove the table";

struct Checker<'a> {
    root: &'a Json,
    renamed: RenamedKeys,
    findings: Vec<Finding>,
}

impl Checker<'_> {
    fn add(&mut self, path: &str, what: String) {
        self.findings.push(Finding::new(path, what));
    }

    fn add_missing(&mut self, path: &str, what: String) {
        self.findings.push(Finding {
            path: path.to_string(),
            what,
            missing: true,
        });
    }

    fn node(&mut self, schema: &Json, value: &Value, path: &str) {
        let keywords = Keywords::of(self.root, schema);
        if keywords.0.contains_key("not") {
            return self.add(path, NO_KIND.into());
        }
        if let Some(variants) = keywords.list("oneOf") {
            return self.variant(variants, value, path);
        }
        match value {
            Value::Table(entries) if keywords.is("object") => self.table(&keywords, entries, path),
            Value::Array(items) if keywords.is("array") => self.array(&keywords, items, path),
            Value::Integer(n) if keywords.is("integer") || keywords.is("number") => {
                self.range(&keywords, *n as f64, path);
            }
            Value::Float(x) if keywords.is("number") => self.range(&keywords, *x, path),
            Value::String(word) if keywords.is("string") => self.text(&keywords, word, path),
            Value::Boolean(_) if keywords.is("boolean") => {}
            other => self.add(path, wrong_type(&keywords, other, path)),
        }
    }

    /// One of several tables that a constant tag distinguishes, or one of several words.
    fn variant(&mut self, variants: &[Json], value: &Value, path: &str) {
        let Some(tag) = variants.iter().find_map(tag_of) else {
            let words: Vec<&str> = variants.iter().filter_map(constant).collect();
            if !value.as_str().is_some_and(|word| words.contains(&word)) {
                self.add(path, not_one_of(&value.to_string(), &words));
            }
            return;
        };
        match chosen(variants, &tag, value) {
            Some(chosen) => self.node(chosen, value, path),
            None => self.tag(variants, &tag, value, path),
        }
    }

    /// The tag is missing or unknown.
    fn tag(&mut self, variants: &[Json], tag: &str, value: &Value, path: &str) {
        let words = variants.iter().map(|v| constant(&v["properties"][tag]));
        let words: Vec<&str> = words.flatten().collect();
        let path = join(path, tag);
        match value.get(tag) {
            Some(given) => self.add(&path, not_one_of(&given.to_string(), &words)),
            None => self.add_missing(&path, not_one_of("missing", &words)),
        }
    }

    fn table(&mut self, keywords: &Keywords, entries: &Table, path: &str) {
        let none = Map::new();
        let properties = keywords.0.get("properties").and_then(Json::as_object);
        let properties = properties.unwrap_or(&none);
        // One schema for all entries of a table whose keys the user chooses.
        let any_key = keywords.0.get("additionalProperties");
        let any_key = any_key.filter(|schema| schema.is_object());
        for (key, value) in entries {
            match properties.get(key).or(any_key) {
                Some(schema) => self.node(schema, value, &join(path, key)),
                None => {
                    let what = unknown_key(self.renamed, path, key, properties);
                    self.add(&join(path, key), what);
                }
            }
        }
        let required = keywords.words("required").into_iter();
        for key in required.filter(|key| !entries.contains_key(*key)) {
            let what = "is missing; add it (this kind of table requires it)".into();
            self.add_missing(&join(path, key), what);
        }
    }

    fn array(&mut self, keywords: &Keywords, items: &[Value], path: &str) {
        let limit = |key| keywords.0.get(key).and_then(Json::as_u64);
        let min = limit("minItems").unwrap_or(0);
        let max = limit("maxItems");
        let count = items.len() as u64;
        if !(min..=max.unwrap_or(u64::MAX)).contains(&count) {
            let allowed = max.map_or(format!("at least {min}"), |max| format!("{min} to {max}"));
            self.add(path, format!("has {count} entries; give {allowed}"));
        }
        let Some(schema) = keywords.0.get("items") else {
            return;
        };
        for (index, item) in items.iter().enumerate() {
            self.node(schema, item, &join(path, &index.to_string()));
        }
    }

    fn range(&mut self, keywords: &Keywords, x: f64, path: &str) {
        let (min, max) = (keywords.number("minimum"), keywords.number("maximum"));
        let is_inside = min.is_none_or(|min| x >= min) && max.is_none_or(|max| x <= max);
        if x.is_finite() && is_inside {
            return;
        }
        let dimension = Dimension::of_key(path);
        let (is, unit) = (dimension.display(x), dimension.si_unit());
        let allowed = format!("{} {unit}", range_text(min, max));
        self.add(path, format!("is {is}; give {}", allowed.trim_end()));
    }

    fn text(&mut self, keywords: &Keywords, word: &str, path: &str) {
        let words = keywords.words("enum");
        if !words.is_empty() && !words.contains(&word) {
            self.add(path, not_one_of(&format!("{word:?}"), &words));
        }
        self.length(keywords, word, path);
    }

    fn length(&mut self, keywords: &Keywords, word: &str, path: &str) {
        let count = word.chars().count() as f64;
        let min = keywords.number("minLength").unwrap_or(0.0);
        let max = keywords.number("maxLength").unwrap_or(f64::INFINITY);
        if !(min..=max).contains(&count) {
            let what = format!("has {count} characters; give a text of {min} to {max} characters");
            self.add(path, what);
        }
    }
}

/// A range in words.
fn range_text(min: Option<f64>, max: Option<f64>) -> String {
    match (min, max) {
        (Some(min), Some(max)) => format!("a value from {min} to {max}"),
        (Some(min), None) => format!("at least {min}"),
        (None, Some(max)) => format!("at most {max}"),
        (None, None) => "a finite value".into(),
    }
}

/// The variant with the tag of a table.
fn chosen<'a>(variants: &'a [Json], tag: &str, value: &Value) -> Option<&'a Json> {
    let word = value.get(tag)?.as_str()?;
    let mut variants = variants.iter();
    variants.find(|variant| constant(&variant["properties"][tag]) == Some(word))
}

/// The path of the entry `key` of a table.
pub fn join(path: &str, key: &str) -> String {
    if path.is_empty() {
        key.to_string()
    } else {
        format!("{path}.{key}")
    }
}

fn constant(schema: &Json) -> Option<&str> {
    schema.get("const").and_then(Json::as_str)
}

/// The property of a variant with a constant.
fn tag_of(variant: &Json) -> Option<String> {
    let mut properties = variant.get("properties")?.as_object()?.iter();
    let (key, _) = properties.find(|(_, schema)| constant(schema).is_some())?;
    Some(key.clone())
}

fn unknown_key(
    renamed: RenamedKeys,
    table: &str,
    key: &str,
    properties: &Map<String, Json>,
) -> String {
    let path = join(table, key);
    if let Some((_, new)) = renamed.iter().find(|(old, _)| *old == path) {
        return format!("was renamed; use `{new}`");
    }
    match nearest(key, properties.keys().map(String::as_str)) {
        Some(nearest) => {
            format!("is not a setting; check the spelling (the nearest is `{nearest}`)")
        }
        None => "is not a setting; leave it out (this table has no settings)".into(),
    }
}

fn not_one_of(given: &str, words: &[&str]) -> String {
    format!("is {given}; choose one of {}", words.join(", "))
}

/// The types in the schema, with an article.
const TYPES: [(&str, &str); 6] = [
    ("number", "a number"),
    ("integer", "an integer"),
    ("string", "a string"),
    ("boolean", "a boolean"),
    ("array", "an array"),
    ("object", "a table"),
];

fn wrong_type(keywords: &Keywords, given: &Value, path: &str) -> String {
    let wanted = TYPES.into_iter().find(|(kind, _)| keywords.is(kind));
    let (kind, wanted) = wanted.unwrap_or(("", "another type"));
    let quantity: Option<Quantity> = given.as_str().and_then(|text| text.parse().ok());
    match quantity.filter(|_| kind == "number") {
        Some(quantity) => text_for_number(given, &quantity, path),
        None => format!(
            "is {given}, of the type {}; give {wanted}",
            given.type_str()
        ),
    }
}

fn text_for_number(given: &Value, quantity: &Quantity, path: &str) -> String {
    let dimension = Dimension::of_key(path);
    match quantity.si(dimension) {
        Ok(x) => format!("is the text {given}, not a number; write {x} (settings are in SI units)"),
        Err(_) => {
            let needed = dimension.description();
            format!("is the text {given}, not a number; write {needed} as a number in SI units")
        }
    }
}
