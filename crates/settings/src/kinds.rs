//! The kinds that a table with `kind = "..."` may name: those of this program, and those that another crate adds when it starts.

use std::sync::{PoisonError, RwLock};

use schemars::{Schema, SchemaGenerator};
use serde_json::{Value as Json, json};
use toml::{Table, Value};

/// One kind of table.
pub trait Kind: Copy + 'static {
    /// The value of `kind`.
    fn name(&self) -> &'static str;

    /// The schema of the table without `kind`.
    fn schema(&self, generator: &mut SchemaGenerator) -> Schema;
}

/// The kinds of a table.
pub struct Kinds<K: 'static> {
    built_in: &'static [K],
    added: RwLock<Vec<K>>,
}

/// A kind that cannot be added.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the kind `{0}` exists already; choose another name")]
pub struct KindExists(pub &'static str);

impl<K: Kind> Kinds<K> {
    /// The kinds of this program.
    pub const fn new(built_in: &'static [K]) -> Self {
        Kinds {
            built_in,
            added: RwLock::new(Vec::new()),
        }
    }

    /// Adds a kind for all tables that are read from now on.
    pub fn add(&self, kind: K) -> Result<(), KindExists> {
        let mut added = self.added.write().unwrap_or_else(PoisonError::into_inner);
        let mut known = self.built_in.iter().chain(added.iter());
        if known.any(|known| known.name() == kind.name()) {
            return Err(KindExists(kind.name()));
        }
        added.push(kind);
        Ok(())
    }

    /// All kinds, in the order in which they were added.
    pub fn all(&self) -> Vec<K> {
        let added = self.added.read().unwrap_or_else(PoisonError::into_inner);
        self.built_in.iter().chain(added.iter()).copied().collect()
    }

    /// Removes `kind` from a table and returns the kind that it names.
    pub fn take(&self, table: &mut Table) -> Result<K, String> {
        let given = table.remove("kind").unwrap_or(Value::String(String::new()));
        let kinds = self.all();
        let named = kinds
            .iter()
            .find(|kind| given.as_str() == Some(kind.name()));
        named.copied().ok_or_else(|| {
            let names: Vec<&str> = kinds.iter().map(Kind::name).collect();
            format!("`kind` is {given}; choose one of {}", names.join(", "))
        })
    }

    /// The schema of a table of any of the kinds.
    pub fn schema(&self, generator: &mut SchemaGenerator) -> Schema {
        let kinds = self.all();
        let tables = kinds.iter().map(|kind| schema_with_kind(kind, generator));
        let tables: Vec<Json> = tables.collect();
        schemars::json_schema!({ "oneOf": tables })
    }
}

/// The schema of a table of this kind, in which `kind` is required.
fn schema_with_kind<K: Kind>(kind: &K, generator: &mut SchemaGenerator) -> Json {
    let mut schema = kind.schema(generator);
    let table = schema.ensure_object();
    let properties = table.entry("properties").or_insert_with(|| json!({}));
    if let Some(properties) = properties.as_object_mut() {
        let name = json!({ "type": "string", "const": kind.name() });
        properties.insert("kind".into(), name);
    }
    let required = table.entry("required").or_insert_with(|| json!([]));
    if let Some(required) = required.as_array_mut() {
        required.insert(0, "kind".into());
    }
    schema.to_value()
}

#[cfg(test)]
mod tests {
    use schemars::{JsonSchema, SchemaGenerator};

    use super::*;
    use crate::check::check;

    #[derive(Clone, Copy)]
    struct Shape {
        name: &'static str,
        schema: fn(&mut SchemaGenerator) -> Schema,
    }

    impl Kind for Shape {
        fn name(&self) -> &'static str {
            self.name
        }

        fn schema(&self, generator: &mut SchemaGenerator) -> Schema {
            (self.schema)(generator)
        }
    }

    #[derive(JsonSchema)]
    #[expect(dead_code, reason = "only its schema is used")]
    struct Circle {
        #[schemars(range(min = 0.0, max = 1.0))]
        radius_m: f64,
    }

    #[derive(JsonSchema)]
    struct Point {}

    const fn shape<T: JsonSchema>(name: &'static str) -> Shape {
        Shape {
            name,
            schema: T::json_schema,
        }
    }

    fn kinds() -> Kinds<Shape> {
        Kinds::new(const { &[shape::<Point>("point")] })
    }

    fn errors(kinds: &Kinds<Shape>, text: &str) -> Vec<String> {
        let schema = kinds.schema(&mut SchemaGenerator::default()).to_value();
        let table: Table = text.parse().expect("TOML");
        let findings = check(&schema, &Value::Table(table), &[]);
        findings
            .iter()
            .map(|f| format!("{} {}", f.path, f.what))
            .collect()
    }

    #[test]
    fn added_kind_is_checked_like_one_of_the_program() {
        let kinds = kinds();
        let circle = "kind = \"circle\"\nradius_m = 2.0";
        assert!(errors(&kinds, circle)[0].contains("kind is \"circle\"; choose one of point"));
        kinds.add(shape::<Circle>("circle")).expect("new");
        assert!(errors(&kinds, circle)[0].contains("radius_m is 2 m; give a value from 0 to 1 m"));
        assert_eq!(errors(&kinds, "kind = \"circle\"\nradius_m = 0.5"), [""; 0]);
        assert_eq!(errors(&kinds, "kind = \"point\""), [""; 0]);
        assert!(errors(&kinds, "radius_m = 0.5")[0].contains("choose one of point, circle"));
    }

    #[test]
    fn refuses_name_that_exists() {
        let kinds = kinds();
        assert_eq!(
            kinds.add(shape::<Circle>("point")),
            Err(KindExists("point"))
        );
        kinds.add(shape::<Circle>("circle")).expect("new");
        assert_eq!(
            kinds.add(shape::<Point>("circle")),
            Err(KindExists("circle"))
        );
    }

    #[test]
    fn takes_kind_out_of_the_table() {
        let mut table: Table = "kind = \"point\"\nx = 1".parse().expect("TOML");
        assert_eq!(kinds().take(&mut table).map(|kind| kind.name), Ok("point"));
        assert_eq!(table.keys().collect::<Vec<_>>(), ["x"]);
        let why = kinds().take(&mut table).err().expect("no kind");
        assert!(why.contains("choose one of point"), "{why}");
    }
}
