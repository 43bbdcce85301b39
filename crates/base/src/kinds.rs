//! The kinds that a table with `kind = "..."` may name: those of this program, and those that another crate adds when it starts.

use std::borrow::Cow;
use std::fmt;
use std::ops::Deref;
use std::sync::{Arc, PoisonError, RwLock};

use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
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
        if tables.is_empty() && self.others.is_empty() {
            // No table is valid. A list of no kinds is no JSON schema; beside an enum, `list_added_kinds` adds it to another one.
            return schemars::json_schema!({ "not": {} });
        }
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

/// A kind whose tables are read as an `R`.
pub struct TableKind<R> {
    name: &'static str,
    schema: fn(&mut SchemaGenerator) -> Schema,
    read: fn(&'static str, Table) -> Result<R, serde_json::Error>,
}

/// A kind whose settings are used through the trait object `S`. [`added_kind!`](crate::added_kind) makes one.
pub type AddedKind<S> = TableKind<Arc<S>>;

impl<R> TableKind<R> {
    /// The kind by its name, its schema, and the function that reads a table without the key that names the kind; it receives
    /// the name as well.
    pub const fn new(
        name: &'static str,
        schema: fn(&mut SchemaGenerator) -> Schema,
        read: fn(&'static str, Table) -> Result<R, serde_json::Error>,
    ) -> Self {
        TableKind { name, schema, read }
    }
}

impl<R> Clone for TableKind<R> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<R> Copy for TableKind<R> {}

impl<R: 'static> Kind for TableKind<R> {
    fn name(&self) -> &'static str {
        self.name
    }

    fn schema(&self, generator: &mut SchemaGenerator) -> Schema {
        (self.schema)(generator)
    }
}

impl<R: 'static> Kinds<TableKind<R>> {
    /// Reads a table by the kind that it names.
    pub fn read(&self, table: Table) -> Result<R, String> {
        self.read_named(table).map(|(_, read)| read)
    }

    /// The name of the kind as well.
    fn read_named(&self, mut table: Table) -> Result<(&'static str, R), String> {
        let kind = self.take(&mut table)?;
        let read = (kind.read)(kind.name, table).map_err(|error| error.to_string())?;
        Ok((kind.name, read))
    }
}

/// The kind `$name` with settings of the type `$settings`, which are read from their table and used through a trait object. The type is
/// `Deserialize`, [`JsonSchema`] and what the trait object needs.
#[macro_export]
macro_rules! added_kind {
    ($name:expr, $settings:ty) => {
        $crate::kinds::AddedKind::new($name, $crate::kinds::schema_of::<$settings>, |_, table| {
            Ok(::std::sync::Arc::new($crate::kinds::settings_in::<
                $settings,
            >(table)?))
        })
    };
}

/// The schema of settings.
pub fn schema_of<T: JsonSchema>(generator: &mut SchemaGenerator) -> Schema {
    T::json_schema(generator)
}

/// The settings in a table.
pub fn settings_in<T: DeserializeOwned>(table: Table) -> Result<T, serde_json::Error> {
    serde_json::from_value(Value::Object(table))
}

/// A trait object whose kinds are registered. [`Added`] settings of it are read and described by these kinds.
pub trait Registered: 'static {
    /// Name of the schema.
    const SCHEMA: &'static str;

    /// Whether the schema is written where it is used, and not among the definitions: [`list_added_kinds`] needs the list itself.
    const IS_INLINE: bool = true;

    /// The kinds.
    fn kinds() -> &'static Kinds<AddedKind<Self>>;
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

impl<S: Registered + ?Sized> Added<S> {
    /// The settings in a table that names their kind.
    pub fn read(table: Table) -> Result<Self, String> {
        let (kind, settings) = S::kinds().read_named(table.clone())?;
        Ok(Added {
            kind,
            table,
            settings,
        })
    }
}

impl<'de, S: Registered + ?Sized> Deserialize<'de> for Added<S> {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let table = Table::deserialize(from)?;
        Added::read(table).map_err(D::Error::custom)
    }
}

impl<S: Registered + ?Sized> JsonSchema for Added<S> {
    fn schema_name() -> Cow<'static, str> {
        S::SCHEMA.into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        S::kinds().schema(generator)
    }

    fn inline_schema() -> bool {
        S::IS_INLINE
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

    const PAIR: AddedKind<dyn Shape> = crate::added_kind!("pair", Pair);

    const fn square(name: &'static str) -> AddedKind<dyn Shape> {
        crate::added_kind!(name, Square)
    }

    fn table(text: &str) -> Table {
        serde_json::from_str(text).expect("an object")
    }

    trait Tile: Shape {}

    impl Tile for Square {}

    static TILES: Kinds<AddedKind<dyn Tile>> =
        Kinds::new("kind", const { &[crate::added_kind!("square", Square)] });

    impl Registered for dyn Tile {
        const SCHEMA: &'static str = "Tile";

        fn kinds() -> &'static Kinds<AddedKind<Self>> {
            &TILES
        }
    }

    #[test]
    fn added_kind_is_read_and_written() {
        let tile = table(r#"{"kind": "tile", "side_m": 0.5}"#);
        let read = |table: &Table| -> Result<Added<dyn Tile>, String> {
            let read = serde_json::from_value(Value::Object(table.clone()));
            read.map_err(|error| error.to_string())
        };
        let why = read(&tile).expect_err("unknown");
        assert_eq!(why, "`kind` is \"tile\"; choose one of square");
        TILES.add(crate::added_kind!("tile", Square)).expect("new");
        let known = read(&tile).expect("known");
        assert_eq!((known.kind(), known.area_m2()), ("tile", 0.25));
        assert_eq!(
            serde_json::to_value(&known).expect("JSON"),
            Value::Object(tile)
        );
        let why = read(&table(r#"{"side_m": 0.5}"#)).expect_err("no kind");
        assert_eq!(why, "`kind` is null; choose one of square, tile");
        let why = read(&table(r#"{"kind": "tile"}"#)).expect_err("no side");
        assert!(why.contains("side_m"), "{why}");
        let schema = schemars::schema_for!(Added<dyn Tile>).to_value();
        assert_eq!(schema["oneOf"].as_array().map(Vec::len), Some(2));
    }

    #[test]
    fn no_table_is_valid_without_kinds() {
        let none: Kinds<AddedKind<dyn Shape>> = Kinds::new("kind", &[]);
        let schema = none.schema(&mut SchemaGenerator::default());
        assert_eq!(schema.to_value(), json!({ "not": {} }));
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
        Added(Added<dyn Shape>),
    }

    impl Registered for dyn Shape {
        const SCHEMA: &'static str = "Shape";

        fn kinds() -> &'static Kinds<AddedKind<Self>> {
            &SHAPES
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
