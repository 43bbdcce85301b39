//! The kinds of excitation. A new one is one file, and one line in `excitations!`.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::chirp::ChirpDesign;
use super::design::ExcitationDesign;
use super::multisine::MultisineSettings;
use super::prbs::PrbsSettings;
use super::stepped_sine::SteppedSineSettings;

/// Declares the kinds that have a table of settings: `/// documentation, Kind(#[attributes] table: Settings)`, where
/// the table of the configuration has the name of the kind in snake case.
macro_rules! excitations {
    ($($(#[$doc:meta])* $kind:ident($(#[$attribute:meta])* $table:ident: $settings:ty)),* $(,)?) => {
        /// The kinds of excitation.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
        #[cfg_attr(feature = "clap", derive(clap::ValueEnum), value(rename_all = "snake_case"))]
        #[serde(rename_all = "snake_case")]
        pub enum ExcitationKind {
            /// A sine of rising or falling frequency, `[chirp]`.
            Chirp,
            $($(#[$doc])* $kind,)*
        }

        impl ExcitationKind {
            /// All kinds.
            pub const ALL: &[ExcitationKind] = &[ExcitationKind::Chirp, $(ExcitationKind::$kind,)*];

            /// The name in configurations and file names.
            pub fn name(self) -> &'static str {
                match self {
                    ExcitationKind::Chirp => "chirp",
                    $(ExcitationKind::$kind => stringify!($table),)*
                }
            }
        }

        /// The tables of all kinds except `[chirp]`.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        pub struct ExcitationTables {
            $($(#[$doc])* $(#[$attribute])* pub $table: $settings,)*
        }

        impl ExcitationTables {
            /// The settings of a kind.
            pub fn design(&self, kind: ExcitationKind) -> &dyn ExcitationDesign {
                match kind {
                    ExcitationKind::Chirp => &ChirpDesign,
                    $(ExcitationKind::$kind => &self.$table,)*
                }
            }
        }
    };
}

excitations! {
    /// Periodic sum of sines; settings in `[multisine]`.
    Multisine(multisine: MultisineSettings),
    /// One frequency after the other; settings in `[stepped_sine]`.
    SteppedSine(stepped_sine: SteppedSineSettings),
    /// Periodic pseudo-random binary sequence; settings in `[prbs]`.
    Prbs(prbs: PrbsSettings),
}
