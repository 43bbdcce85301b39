//! Models of other crates.

use bench_base::added_kind;
use bench_base::kinds::{Added, AddedKind, KindExists, Kinds, Registered, Table};
use schemars::JsonSchema;
use serde::Deserialize;
use serde::de::{DeserializeOwned, Error};
use serde_json::Value;

use super::{MODELS, PlantModel};

/// The models of other crates by their `model`.
static PLANTS: Kinds<AddedKind<dyn PlantModel>> = Kinds::beside(KEY, MODELS);

/// The key that names the model in `[plant]`.
const KEY: &str = "model";

/// A model of another crate.
pub type OwnPlant = Added<dyn PlantModel>;

impl Registered for dyn PlantModel {
    const SCHEMA: &'static str = "OwnPlant";

    fn kinds() -> &'static Kinds<AddedKind<Self>> {
        &PLANTS
    }
}

/// Adds a model that a configuration may name as `model` in its table `[plant]`. Call it before the command line's `main`.
///
/// ```
/// use bench_plant::{Assembly, PlantModel, PlantSettings, Structure, build};
/// use schemars::JsonSchema;
/// use serde::Deserialize;
///
/// /// A mass on a spring.
/// #[derive(Deserialize, JsonSchema)]
/// struct Oscillator {
///     /// Mass in kilograms.
///     #[schemars(range(min = 1e-6, max = 1e6))]
///     mass_kg: f64,
///     /// Stiffness in newtons per metre.
///     #[schemars(range(min = 1e-6, max = 1e12))]
///     stiffness_n_per_m: f64,
/// }
///
/// impl PlantModel for Oscillator {
///     fn coordinates(&self) -> Vec<&str> {
///         vec!["x"]
///     }
///     fn undamped(&self) -> Structure {
///         let mut parts = Assembly::new(1);
///         parts.add_mass(self.mass_kg, &[1.0], &[0.0]);
///         parts.add_spring(self.stiffness_n_per_m, &[1.0]);
///         parts.into_structure(&[1.0], &[1.0])
///     }
/// }
///
/// bench_plant::register_plant::<Oscillator>("oscillator")?;
/// let text = "model = 'oscillator'\nmass_kg = 2.0\nstiffness_n_per_m = 50.0";
/// let plant: PlantSettings = toml::from_str(text)?;
/// assert_eq!(build(&plant)?.stiffness[(0, 0)], 50.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn register_plant<P>(model: &'static str) -> Result<(), KindExists>
where
    P: PlantModel + DeserializeOwned + JsonSchema + 'static,
{
    PLANTS.add(added_kind!(model, P))
}

/// The same model with the settings of a table without its name.
pub(super) fn with_table(own: &OwnPlant, table: &Value) -> serde_json::Result<OwnPlant> {
    let mut table = Table::deserialize(table)?;
    table.insert(KEY.into(), Value::String(own.kind().into()));
    OwnPlant::read(table).map_err(serde_json::Error::custom)
}
