//! Excitations of other crates.

use bench_base::added_kind;
use bench_base::kinds::{Added, AddedKind, KindExists, Kinds, Registered};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use super::design::ExcitationDesign;

/// The settings of an excitation of another crate.
type Design = dyn ExcitationDesign + Send + Sync;

/// The excitations of other crates by their `kind`.
static EXCITATIONS: Kinds<AddedKind<Design>> = Kinds::new("kind", &[]);

/// An excitation of another crate.
pub type OwnExcitation = Added<Design>;

impl Registered for Design {
    const SCHEMA: &'static str = "OwnExcitation";
    const IS_INLINE: bool = false;

    fn kinds() -> &'static Kinds<AddedKind<Design>> {
        &EXCITATIONS
    }
}

/// Adds an excitation that a configuration with `excitation.kind = "own"` may name as `kind` in its table `[own_excitation]`. Band, rest
/// times, fades and amplitude over frequency are in `[chirp]`, as for every excitation. Call it before the command line's `main`.
///
/// # Errors
/// When another crate has added this kind.
///
/// ```
/// use bench_excitation::{Excitation, ExcitationDesign, Length, OwnExcitation, SharedSettings};
/// use schemars::JsonSchema;
/// use serde::Deserialize;
///
/// /// A pulse of current to one side, and the same to the other.
/// #[derive(Clone, Copy, Deserialize, JsonSchema)]
/// struct Doublet {
///     /// Current in amperes.
///     #[schemars(range(min = 1e-6, max = 10.0))]
///     amplitude_a: f64,
///     /// Length of each pulse in ticks.
///     pulse_ticks: u64,
///     /// Time to come to rest in ticks.
///     rest_ticks: u64,
/// }
///
/// impl ExcitationDesign for Doublet {
///     fn describe(&self, _: &SharedSettings<'_>) -> String {
///         format!("doublet of {} A", self.amplitude_a)
///     }
///     fn length(&self, _: &SharedSettings<'_>) -> Length {
///         let ticks = (2 * self.pulse_ticks + self.rest_ticks) as f64;
///         Length { ticks, key: "own_excitation.rest_ticks", value: self.rest_ticks as f64 }
///     }
///     fn build(&self, _: &SharedSettings<'_>) -> Box<dyn Excitation> {
///         Box::new(*self)
///     }
/// }
///
/// impl Excitation for Doublet {
///     fn ticks(&self) -> u64 {
///         2 * self.pulse_ticks + self.rest_ticks
///     }
///     fn current_a(&self, tick: u64) -> f64 {
///         match tick / self.pulse_ticks {
///             0 => self.amplitude_a,
///             1 => -self.amplitude_a,
///             _ => 0.0,
///         }
///     }
/// }
///
/// bench_excitation::register_excitation::<Doublet>("doublet")?;
/// let text = "kind = 'doublet'\namplitude_a = 0.1\npulse_ticks = 10\nrest_ticks = 5000";
/// let excitation: OwnExcitation = toml::from_str(text)?;
/// assert_eq!(excitation.kind(), "doublet");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn register_excitation<E>(kind: &'static str) -> Result<(), KindExists>
where
    E: ExcitationDesign + DeserializeOwned + JsonSchema + Send + Sync + 'static,
{
    EXCITATIONS.add(added_kind!(kind, E))
}
