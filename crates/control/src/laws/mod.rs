//! Control laws that a controller file may name in `[law]`, beside the cascade of sections.
//!
//! A new law is one file here with its settings, and one line in `control_laws!`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::law::ControlDesign;

/// Settings of a control law in a controller file.
trait ControlLawSettings: ControlDesign {
    /// Refuses settings that are inconsistent with each other or with the servo rate; the text follows the key `law`.
    fn check(&self, rate_hz: f64) -> Result<(), String>;
}

/// Declares the module of each law, and the enum of their settings: `/// documentation, Kind(module::Settings)`.
macro_rules! control_laws {
    ($($(#[$doc:meta])* $kind:ident($module:ident::$settings:ident)),* $(,)?) => {
        $(mod $module; pub use $module::$settings;)*

        /// A control law by its kind.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "kind", rename_all = "snake_case")]
        pub enum LawSettings {
            $($(#[$doc])* $kind($settings),)*
        }

        impl LawSettings {
            /// Refuses settings that are inconsistent with each other or with the servo rate.
            pub(super) fn check(&self, rate_hz: f64) -> Result<(), String> {
                match self { $(LawSettings::$kind(settings) => settings.check(rate_hz),)* }
            }

            /// The law.
            pub(super) fn design(self) -> Box<dyn ControlDesign> {
                match self { $(LawSettings::$kind(settings) => Box::new(settings),)* }
            }
        }
    };
}

control_laws! {
    /// Matrices of a discrete linear law with reference and position as inputs.
    StateSpace(matrices::StateSpaceLaw),
    /// A disturbance or reference of a known period is learned from the error of the period before.
    Repetitive(repetitive::RepetitiveLaw),
}
