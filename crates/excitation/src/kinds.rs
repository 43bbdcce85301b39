//! The kinds of excitation. A new one is one file, and one line in `excitations!`; one of another crate is added by
//! [`register_excitation`](super::register_excitation).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::check::ExcitationError;
use super::chirp::ChirpDesign;
use super::design::ExcitationDesign;
use super::multisine::MultisineSettings;
use super::own::OwnExcitation;
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
            /// An excitation of another crate; settings in `[own_excitation]`.
            Own,
        }

        impl ExcitationKind {
            /// All kinds of this crate.
            pub const ALL: &[ExcitationKind] = &[ExcitationKind::Chirp, $(ExcitationKind::$kind,)*];

            /// The name in configurations and file names.
            pub fn name(self) -> &'static str {
                match self {
                    ExcitationKind::Chirp => "chirp",
                    $(ExcitationKind::$kind => stringify!($table),)*
                    ExcitationKind::Own => "own",
                }
            }
        }

        /// The tables of all kinds except `[chirp]`.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
        pub struct ExcitationTables {
            $($(#[$doc])* $(#[$attribute])* pub $table: $settings,)*
            /// An excitation of another crate, by its `kind`; needed for `excitation.kind = "own"`.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            #[schemars(with = "OwnExcitation")]
            pub own_excitation: Option<OwnExcitation>,
        }

        impl ExcitationTables {
            /// The settings of a kind.
            ///
            /// # Errors
            /// When the kind is `own` and its table is absent; the check of a configuration refuses that.
            pub fn design(
                &self,
                kind: ExcitationKind,
            ) -> Result<&dyn ExcitationDesign, ExcitationError> {
                Ok(match kind {
                    ExcitationKind::Chirp => &ChirpDesign,
                    $(ExcitationKind::$kind => &self.$table,)*
                    ExcitationKind::Own => {
                        let own = self.own_excitation.as_ref();
                        &**own.ok_or(ExcitationError::NoOwnTable)?
                    }
                })
            }

            /// The amplitude in amperes of a kind that has the same one at all frequencies. That of a kind of another crate is planned
            /// there.
            pub fn one_amplitude_a(&mut self, kind: ExcitationKind) -> Option<&mut f64> {
                match kind {
                    ExcitationKind::Chirp | ExcitationKind::Own => None,
                    $(ExcitationKind::$kind => self.$table.one_amplitude_a(),)*
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_profile::profile;

    #[test]
    fn own_excitation_without_its_table_is_refused() {
        let tables = profile().excitations;
        assert!(tables.own_excitation.is_none());
        let refused = tables.design(ExcitationKind::Own).err();
        assert_eq!(refused, Some(ExcitationError::NoOwnTable));
        for kind in ExcitationKind::ALL {
            assert!(tables.design(*kind).is_ok(), "{}", kind.name());
        }
    }
}
