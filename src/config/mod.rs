//! Typed settings in SI units.
//!
//! ```text
//!  stage.toml  <-  profile or file  <-  --set KEY=VALUE     three layers of TOML, the later one wins
//!        \______________ merge ______________/
//!                          |  check: keys, types and ranges against the schema made from the types
//!                          |  deserialise: serde
//!                          v  cross-checks between settings
//!                       Config                              immutable from here on
//! ```
//!
//! The types are the only description: the schema (`bench config schema`), the ranges that are enforced and the
//! documentation of each key come from them; the values come from `bench-config/stage.toml`.

mod calibration;
mod campaign;
mod check;
mod control;
mod cross_checks;
mod devices;
mod error;
mod excitation;
mod identify;
mod interlock;
mod layer;
mod load;
mod overrides;
mod place;
pub mod profiles;
mod purpose;
mod relations;
mod renamed;
mod rig;
mod servo;
mod settings;
mod signal_path;
mod sim;

pub use crate::excitation::{
    AmplitudePoint, ChirpSettings, ExcitationKind, Lines, MultisineSettings, PrbsSettings,
    ReferenceSettings, Spacing, SteppedSineSettings, Sweep, TravelPoint,
};
pub use calibration::*;
pub use campaign::*;
pub use control::*;
pub use devices::*;
pub use error::ConfigError;
pub use excitation::*;
pub use identify::*;
pub use interlock::*;
pub use load::{Source, load, whole};
pub(crate) use load::{text_of, text_of_file, typed, validate};
pub use overrides::OptionSetting;
pub use purpose::Purpose;
pub use rig::*;
pub use servo::*;
pub use settings::*;
pub use sim::*;

pub use crate::model::plant::{
    DampingPoint, DampingSettings, LumpedSettings, ModalSettings, ModeSettings, NodeSettings,
    PlantSettings, SecondaryMassDeviation, SpringSettings, Sr4dofSettings, XyLayout, XySettings,
};

/// The JSON schema of a configuration, made from the types.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(Config).to_value()
}
