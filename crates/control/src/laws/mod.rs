//! Control laws that a controller file may name in `[law]`, beside the cascade of sections.
//!
//! A new law is one file here with its settings, and one line in [`LAWS`]. A law of another crate is added by [`register_law`].

mod matrices;
mod repetitive;

pub use matrices::StateSpaceLaw;
pub use repetitive::RepetitiveLaw;

use std::borrow::Cow;

use bench_base::kinds::{Kind, KindExists, Kinds, Table};
use schemars::{JsonSchema, Schema, SchemaGenerator};
use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error};
use serde_json::Value;

use super::law::ControlDesign;

/// The laws by the `kind` of their table.
static LAWS: Kinds<LawKind> = Kinds::new(
    "kind",
    const {
        &[
            LawKind::of::<StateSpaceLaw>("state_space"),
            LawKind::of::<RepetitiveLaw>("repetitive"),
        ]
    },
);

/// Settings of a control law in a controller file.
pub trait ControlLawSettings: ControlDesign {
    /// Refuses settings that are inconsistent with each other or with the servo rate; the text follows "`law`", for example "has
    /// lead_ticks = 8, which must be below period_ticks = 8". Ranges of single settings are in their schema.
    fn check(&self, rate_hz: f64) -> Result<(), String> {
        let _ = rate_hz;
        Ok(())
    }
}

/// Adds a control law that a controller file may name as `kind` in its table `[law]`. Call it before the command line's `main`.
///
/// ```
/// use bench_control::{ControlDesign, ControlLaw, ControlLawSettings, ControllerText, LawInput};
/// use schemars::JsonSchema;
/// use serde::Deserialize;
///
/// /// u = K (r - y).
/// #[derive(Clone, Copy, Deserialize, JsonSchema)]
/// struct Proportional {
///     /// K in amperes per metre.
///     #[schemars(range(min = 0.0, max = 1e6))]
///     gain_a_per_m: f64,
/// }
///
/// impl ControlDesign for Proportional {
///     fn law(&self, _period_s: f64) -> Box<dyn ControlLaw> {
///         Box::new(*self)
///     }
/// }
///
/// impl ControlLawSettings for Proportional {}
///
/// impl ControlLaw for Proportional {
///     fn reset(&mut self, _rest_m: f64) {}
///     fn update(&mut self, input: &LawInput) -> f64 {
///         self.gain_a_per_m * (input.reference_m - input.position_m)
///     }
/// }
///
/// bench_control::register_law::<Proportional>("proportional")?;
/// let controller = ControllerText {
///     name: "own.toml".into(),
///     text: "title = 'own'\n[law]\nkind = 'proportional'\ngain_a_per_m = 1e4".into(),
/// };
/// let mut law = controller.design(5000.0)?.law(200e-6);
/// let input = LawInput { reference_m: 2e-6, ..LawInput::default() };
/// assert_eq!(law.update(&input), 0.02);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn register_law<L>(kind: &'static str) -> Result<(), KindExists>
where
    L: ControlLawSettings + DeserializeOwned + JsonSchema + 'static,
{
    LAWS.add(LawKind::of::<L>(kind))
}

/// A law that a file may name.
#[derive(Clone, Copy)]
struct LawKind {
    name: &'static str,
    schema: fn(&mut SchemaGenerator) -> Schema,
    read: fn(Table) -> Result<Law, serde_json::Error>,
}

impl LawKind {
    const fn of<L>(name: &'static str) -> LawKind
    where
        L: ControlLawSettings + DeserializeOwned + JsonSchema + 'static,
    {
        LawKind {
            name,
            schema: L::json_schema,
            read: |table| {
                let settings: L = serde_json::from_value(Value::Object(table))?;
                Ok(Law(Box::new(settings)))
            },
        }
    }
}

impl Kind for LawKind {
    fn name(&self) -> &'static str {
        self.name
    }

    fn schema(&self, generator: &mut SchemaGenerator) -> Schema {
        (self.schema)(generator)
    }
}

/// The settings of a law of any kind.
pub(super) struct Law(pub Box<dyn ControlLawSettings>);

impl<'de> Deserialize<'de> for Law {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        let mut table = Table::deserialize(from)?;
        let kind = LAWS.take(&mut table).map_err(D::Error::custom)?;
        (kind.read)(table).map_err(D::Error::custom)
    }
}

impl JsonSchema for Law {
    fn schema_name() -> Cow<'static, str> {
        "Law".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        LAWS.schema(generator)
    }

    /// The kinds may change between two schemas.
    fn inline_schema() -> bool {
        true
    }
}
