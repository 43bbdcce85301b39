//! Control laws that a controller file may name in `[law]`, beside the cascade of sections.
//!
//! A new law is one file here with its settings, and one line in [`LAWS`]. A law of another crate is added by [`register_law`].

mod matrices;
mod repetitive;

pub use matrices::StateSpaceLaw;
pub use repetitive::RepetitiveLaw;

use bench_base::added_kind;
use bench_base::kinds::{Added, AddedKind, KindExists, Kinds, Registered};
use schemars::JsonSchema;
use serde::de::DeserializeOwned;

use super::Section;
use super::law::{ControlDesign, ControlLaw};

/// The laws by the `kind` of their table.
static LAWS: Kinds<AddedKind<dyn ControlLawSettings>> = Kinds::new(
    "kind",
    const {
        &[
            added_kind!("state_space", StateSpaceLaw),
            added_kind!("repetitive", RepetitiveLaw),
        ]
    },
);

/// Settings of a control law in a controller file.
pub trait ControlLawSettings: ControlDesign + Sync {
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
    LAWS.add(added_kind!(kind, L))
}

/// The settings of a law of any kind.
pub(super) type LawSettings = Added<dyn ControlLawSettings>;

impl Registered for dyn ControlLawSettings {
    const SCHEMA: &'static str = "LawSettings";

    fn kinds() -> &'static Kinds<AddedKind<Self>> {
        &LAWS
    }
}

impl ControlDesign for LawSettings {
    fn law(&self, period_s: f64) -> Box<dyn ControlLaw> {
        (**self).law(period_s)
    }

    fn sections(&self) -> Option<&[Section]> {
        (**self).sections()
    }
}
