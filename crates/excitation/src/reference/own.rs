//! References of other crates.

use bench_base::added_kind;
use bench_base::kinds::{Added, AddedKind, KindExists, Kinds, Registered};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use super::{KINDS, ReferenceDesign};

/// The settings of a reference of another crate.
type Design = dyn ReferenceDesign + Send + Sync;

/// The references of other crates by their `kind`.
static REFERENCES: Kinds<AddedKind<Design>> = Kinds::beside("kind", KINDS);

/// A reference of another crate.
pub type OwnReference = Added<Design>;

impl Registered for Design {
    const SCHEMA: &'static str = "OwnReference";

    fn kinds() -> &'static Kinds<AddedKind<Design>> {
        &REFERENCES
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
    REFERENCES.add(added_kind!(kind, R))
}
