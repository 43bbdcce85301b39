//! The kinds that a table with `kind = "..."` may name: those of this program, and those that another crate adds when it starts.

use std::fmt;
use std::ops::Deref;
use std::sync::{Arc, PoisonError, RwLock};

use schemars::{Schema, SchemaGenerator};
use serde::{Serialize, Serializer};
use serde_json::{Map, Value, json};

/// A table of settings, without or with the key that names its kind.
pub type Table = Map<String, Value>;

/// One kind of table.
pub trait Kind: Copy + 'static {
    /// The value of the key that names the kind.
    fn name(&self) -> &'static str;

    /// The schema of the table without this key.
    fn schema(&self, generator: &mut SchemaGenerator) -> Schema;
}

/// The kinds of a table.
pub struct Kinds<K: 'static> {
    /// The key that names the kind.
    key: &'static str,
    /// Names of the kinds that stand elsewhere.
    others: &'static [&'static str],
    built_in: &'static [K],
    added: RwLock<Vec<K>>,
}

/// A kind that cannot be added.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("the kind `{0}` exists already; choose another name")]
pub struct KindExists(pub &'static str);

impl<K: Kind> Kinds<K> {
    /// The kinds of this program; `key` names the kind, as in `kind = "..."`.
    pub const fn new(key: &'static str, built_in: &'static [K]) -> Self {
        Kinds {
            key,
            others: &[],
            built_in,
            added: RwLock::new(Vec::new()),
        }
    }

    /// Kinds that are added to those of an enum, which have the names `others`.
    pub const fn beside(key: &'static str, others: &'static [&'static str]) -> Self {
        Kinds {
            key,
            others,
            built_in: &[],
            added: RwLock::new(Vec::new()),
        }
    }

    /// Adds a kind for all tables that are read from now on.
    pub fn add(&self, kind: K) -> Result<(), KindExists> {
        let mut added = self.added.write().unwrap_or_else(PoisonError::into_inner);
        let mut known = self.built_in.iter().chain(added.iter());
        if self.others.contains(&kind.name()) || known.any(|known| known.name() == kind.name()) {
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

    /// Removes the key from a table and returns the kind that it names.
    pub fn take(&self, table: &mut Table) -> Result<K, String> {
        let given = table.remove(self.key).unwrap_or_default();
        let kinds = self.all();
        let named = kinds
            .iter()
            .find(|kind| given.as_str() == Some(kind.name()));
        named.copied().ok_or_else(|| {
            let names: Vec<&str> = kinds.iter().map(Kind::name).collect();
            format!(
                "`{}` is {given}; choose one of {}",
                self.key,
                names.join(", ")
            )
        })
    }

    /// The schema of a table of any of the kinds.
    pub fn schema(&self, generator: &mut SchemaGenerator) -> Schema {
        let tables = self.tables(generator);
        schemars::json_schema!({ "oneOf": tables })
    }

    fn tables(&self, generator: &mut SchemaGenerator) -> Vec<Value> {
        let kinds = self.all();
        let tables = kinds
            .iter()
            .map(|kind| schema_with_key(self.key, kind, generator));
        tables.collect()
    }
}

/// Transforms the schema of an enum whose last variant has no tag and holds added kinds, with [`Kinds::schema`] as its schema:
/// the tables of the other variants and those of the added kinds become one list, `oneOf`.
///
/// # Panics
/// When the schema is not that of such an enum: without the added kinds in it, each table that names one would be refused.
pub fn list_added_kinds(schema: &mut Schema) {
    // schemars writes `anyOf` because one variant has no tag.
    let variants = schema.remove("anyOf");
    let tables = variants.as_ref().and_then(listed_tables);
    let Some(tables) = tables else {
        panic!("not an enum with added kinds in its last variant: {variants:?}");
    };
    schema.insert("oneOf".into(), tables.into());
}

/// The tables of the variants, with those of the last one in its place.
fn listed_tables(variants: &Value) -> Option<Vec<Value>> {
    let (last, others) = variants.as_array()?.split_last()?;
    let added = last.get("oneOf")?.as_array()?;
    Some([others, added].concat())
}

/// The schema of a table of this kind, in which the key that names the kind is required.
fn schema_with_key<K: Kind>(key: &str, kind: &K, generator: &mut SchemaGenerator) -> Value {
    let mut schema = kind.schema(generator);
    let table = schema.ensure_object();
    let properties = table.entry("properties").or_insert_with(|| json!({}));
    if let Some(properties) = properties.as_object_mut() {
        let name = json!({ "type": "string", "const": kind.name() });
        properties.insert(key.into(), name);
    }
    let required = table.entry("required").or_insert_with(|| json!([]));
    if let Some(required) = required.as_array_mut() {
        required.insert(0, key.into());
    }
    schema.to_value()
}

/// A kind whose settings are used through the trait object `S`.
pub struct AddedKind<S: ?Sized> {
    name: &'static str,
    schema: fn(&mut SchemaGenerator) -> Schema,
    read: fn(Table) -> Result<Arc<S>, serde_json::Error>,
}

impl<S: ?Sized> AddedKind<S> {
    /// The kind by its name, its schema, and the function that reads a table without the key that names the kind.
    pub const fn new(
        name: &'static str,
        schema: fn(&mut SchemaGenerator) -> Schema,
        read: fn(Table) -> Result<Arc<S>, serde_json::Error>,
    ) -> Self {
        AddedKind { name, schema, read }
    }
}

impl<S: ?Sized> Clone for AddedKind<S> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<S: ?Sized> Copy for AddedKind<S> {}

impl<S: ?Sized + 'static> Kind for AddedKind<S> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn schema(&self, generator: &mut SchemaGenerator) -> Schema {
        (self.schema)(generator)
    }
}

impl<S: ?Sized + 'static> Kinds<AddedKind<S>> {
    /// The settings in a table.
    pub fn read(&self, table: Table) -> Result<Added<S>, String> {
        let mut settings = table.clone();
        let kind = self.take(&mut settings)?;
        let settings = (kind.read)(settings).map_err(|error| error.to_string())?;
        Ok(Added {
            kind: kind.name,
            table,
            settings,
        })
    }
}

/// The settings of an added kind, with the table that they were read from.
pub struct Added<S: ?Sized> {
    kind: &'static str,
    table: Table,
    settings: Arc<S>,
}

impl<S: ?Sized> Added<S> {
    /// The name of the kind.
    pub fn kind(&self) -> &'static str {
        self.kind
    }
}

impl<S: ?Sized> Deref for Added<S> {
    type Target = S;

    fn deref(&self) -> &S {
        &self.settings
    }
}

impl<S: ?Sized> Clone for Added<S> {
    fn clone(&self) -> Self {
        Added {
            kind: self.kind,
            table: self.table.clone(),
            settings: Arc::clone(&self.settings),
        }
    }
}

impl<S: ?Sized> fmt::Debug for Added<S> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.table.fmt(f)
    }
}

impl<S: ?Sized> PartialEq for Added<S> {
    fn eq(&self, other: &Self) -> bool {
        self.table == other.table
    }
}

impl<S: ?Sized> Serialize for Added<S> {
    fn serialize<T: Serializer>(&self, to: T) -> Result<T::Ok, T::Error> {
        self.table.serialize(to)
    }
}

#[cfg(test)]
mod tests {
    use std::borrow::Cow;

    use schemars::JsonSchema;

    use super::*;

    trait Shape {
        fn area_m2(&self) -> f64;
    }

    #[derive(serde::Deserialize, JsonSchema)]
    struct Square {
        #[schemars(range(min = 0.0, max = 1.0))]
        side_m: f64,
    }

    impl Shape for Square {
        fn area_m2(&self) -> f64 {
            self.side_m * self.side_m
        }
    }

    #[derive(serde::Deserialize, JsonSchema)]
    struct Pair {
        left: Square,
        right: Square,
    }

    impl Shape for Pair {
        fn area_m2(&self) -> f64 {
            self.left.area_m2() + self.right.area_m2()
        }
    }

    const PAIR: AddedKind<dyn Shape> = AddedKind::new("pair", Pair::json_schema, |table| {
        let settings: Pair = serde_json::from_value(Value::Object(table))?;
        Ok(Arc::new(settings))
    });

    const fn square(name: &'static str) -> AddedKind<dyn Shape> {
        AddedKind::new(name, Square::json_schema, |table| {
            let settings: Square = serde_json::from_value(Value::Object(table))?;
            Ok(Arc::new(settings))
        })
    }

    fn table(text: &str) -> Table {
        serde_json::from_str(text).expect("an object")
    }

    #[test]
    fn added_kind_is_read_and_written() {
        let kinds = Kinds::new("kind", const { &[square("square")] });
        let tile = table(r#"{"kind": "tile", "side_m": 0.5}"#);
        let why = kinds.read(tile.clone()).expect_err("unknown");
        assert_eq!(why, "`kind` is \"tile\"; choose one of square");
        kinds.add(square("tile")).expect("new");
        let read = kinds.read(tile.clone()).expect("known");
        assert_eq!((read.kind(), read.area_m2()), ("tile", 0.25));
        assert_eq!(
            serde_json::to_value(&read).expect("JSON"),
            Value::Object(tile)
        );
        let why = kinds
            .read(table(r#"{"side_m": 0.5}"#))
            .expect_err("no kind");
        assert_eq!(why, "`kind` is null; choose one of square, tile");
        let why = kinds
            .read(table(r#"{"kind": "tile"}"#))
            .expect_err("no side");
        assert!(why.contains("side_m"), "{why}");
    }

    #[test]
    fn refuses_name_that_exists() {
        let kinds = Kinds::beside("kind", &["circle"]);
        assert_eq!(kinds.add(square("circle")), Err(KindExists("circle")));
        kinds.add(square("tile")).expect("new");
        assert_eq!(kinds.add(square("tile")), Err(KindExists("tile")));
    }

    #[test]
    fn schema_of_each_kind_requires_its_name() {
        let kinds = Kinds::new("kind", const { &[square("square")] });
        kinds.add(square("tile")).expect("new");
        let schema = kinds.schema(&mut SchemaGenerator::default()).to_value();
        let of_kind = |index: usize| &schema["oneOf"][index];
        assert_eq!(of_kind(1)["properties"]["kind"]["const"], "tile");
        assert_eq!(of_kind(1)["properties"]["side_m"]["maximum"], 1.0);
        assert_eq!(of_kind(0)["required"], json!(["kind", "side_m"]));
    }

    static SHAPES: Kinds<AddedKind<dyn Shape>> = Kinds::beside("kind", &["circle"]);

    #[derive(JsonSchema)]
    #[schemars(tag = "kind", rename_all = "snake_case", transform = list_added_kinds)]
    #[expect(dead_code, reason = "only its schema is of interest")]
    enum AnyShape {
        Circle {
            radius_m: f64,
        },
        #[schemars(untagged)]
        Added(AddedShape),
    }

    struct AddedShape;

    impl JsonSchema for AddedShape {
        fn schema_name() -> Cow<'static, str> {
            "AddedShape".into()
        }

        fn json_schema(generator: &mut SchemaGenerator) -> Schema {
            SHAPES.schema(generator)
        }

        fn inline_schema() -> bool {
            true
        }
    }

    #[test]
    fn schema_of_enum_lists_variants_and_added_kinds() {
        let schema = schemars::schema_for!(AnyShape).to_value();
        assert_eq!(schema["oneOf"].as_array().map(Vec::len), Some(1));
        SHAPES.add(PAIR).expect("new");
        let schema = schemars::schema_for!(AnyShape).to_value();
        let name = |index: usize| &schema["oneOf"][index]["properties"]["kind"]["const"];
        assert_eq!((name(0), name(1)), (&json!("circle"), &json!("pair")));
        let left = &schema["oneOf"][1]["properties"]["left"]["$ref"];
        assert_eq!(left, "#/$defs/Square");
        assert_eq!(
            schema["$defs"]["Square"]["properties"]["side_m"]["maximum"],
            1.0
        );
        assert_eq!(schema.get("anyOf"), None);
    }

    #[test]
    #[should_panic(expected = "not an enum with added kinds")]
    fn refuses_schema_without_place_for_added_kinds() {
        list_added_kinds(&mut schemars::json_schema!({ "oneOf": [{ "title": "circle" }] }));
    }
}
