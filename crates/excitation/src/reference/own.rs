//! References of other crates.

use std::borrow::Cow;
use std::sync::Arc;

use bench_base::kinds::{Added, AddedKind, KindExists, Kinds, Table};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{DeserializeOwned, Error};
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;

use super::{KINDS, ReferenceDesign};

/// The settings of a reference of another crate.
type Design = dyn ReferenceDesign + Send + Sync;

/// The references of other crates by their `kind`.
static REFERENCES: Kinds<AddedKind<Design>> = Kinds::beside("kind", KINDS);

/// A reference of another crate.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OwnReference(Added<Design>);

impl OwnReference {
    /// The name of the kind.
    pub fn kind(&self) -> &'static str {
        self.0.kind()
    }

    /// The settings.
    pub fn design(&self) -> &dyn ReferenceDesign {
        &*self.0
    }
}

/// Adds a reference that a configuration may name as `kind` in its table `[control.reference]`. Call it before the command line's
/// `main`.
///
/// ```
/// use bench_excitation::{Reference, ReferenceContext, ReferenceDesign, ReferenceError, ReferenceSettings};
/// use schemars::JsonSchema;
/// use serde::Deserialize;
///
/// /// A pulse.
/// #[derive(Clone, Copy, Deserialize, JsonSchema)]
/// struct Pulse {
///     /// Height in metres.
///     #[schemars(range(min = -1.0, max = 1.0))]
///     height_m: f64,
///     /// Length in ticks.
///     ticks: u64,
/// }
///
/// impl ReferenceDesign for Pulse {
///     fn describe(&self) -> String {
///         format!("a pulse of {} m", self.height_m)
///     }
///     fn build(&self, _: &ReferenceContext<'_>) -> Result<Box<dyn Reference>, ReferenceError> {
///         Ok(Box::new(*self))
///     }
/// }
///
/// impl Reference for Pulse {
///     fn at_m(&self, tick: u64) -> f64 {
///         if tick < self.ticks { self.height_m } else { 0.0 }
///     }
/// }
///
/// bench_excitation::register_reference::<Pulse>("pulse")?;
/// let text = "kind = 'pulse'\nheight_m = 1e-6\nticks = 10";
/// let reference: ReferenceSettings = toml::from_str(text)?;
/// assert_eq!(reference.kind(), "pulse");
/// assert_eq!(reference.design().describe(), "a pulse of 0.000001 m");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn register_reference<R>(kind: &'static str) -> Result<(), KindExists>
where
    R: ReferenceDesign + DeserializeOwned + JsonSchema + Send + Sync + 'static,
{
    REFERENCES.add(AddedKind::new(kind, R::json_schema, |table| {
        let settings: R = serde_json::from_value(Value::Object(table))?;
        Ok(Arc::new(settings))
    }))
}

impl<'de> Deserialize<'de> for OwnReference {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let table = Table::deserialize(from)?;
        REFERENCES
            .read(table)
            .map(OwnReference)
            .map_err(D::Error::custom)
    }
}

impl JsonSchema for OwnReference {
    fn schema_name() -> Cow<'static, str> {
        "OwnReference".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        REFERENCES.schema(generator)
    }

    /// [`list_added_kinds`](bench_base::kinds::list_added_kinds) needs the list itself.
    fn inline_schema() -> bool {
        true
    }
}
