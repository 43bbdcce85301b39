//! Typed settings in SI units.
//!
//! ```text
//!  stage.toml  <-  profile or file  <-  --set KEY=VALUE     three layers of TOML, a later one overrides earlier ones
//!        \______________ merge ______________/
//!                          |  check: keys, types and ranges against the schema made from the types
//!                          |  deserialise: serde
//!                          v  cross-checks between settings
//!                       Config                              does not change during a run
//! ```
//!
//! The types define everything about a key: the schema (`bench config schema`), the range and the documentation are made from
//! them. The default values are in `bench-config/stage.toml`.

#![deny(unsafe_code)]

mod calibration;
mod campaign;
mod command;
mod command_checks;
mod control;
mod cross_checks;
mod devices;
mod differences;
mod excitation;
mod interlock;
mod load;
mod monitor_checks;
mod mounting_checks;
mod overrides;
pub mod profiles;
mod purpose;
mod relations;
mod renamed;
mod rig;
mod rig_model;
mod servo;
mod settings;
mod signal_path;
mod sim;
mod warnings;

pub use bench_excitation::{
    AmplitudePoint, ChirpSettings, ExcitationKind, Lines, MultisineSettings, PrbsSettings,
    ReferenceSettings, Spacing, SteppedSineSettings, Sweep, TravelPoint,
};
pub use bench_identify::{
    Estimator, EstimatorSettings, IdentifySettings, LocalModel, ResolutionPoint,
};
pub use bench_settings::ConfigError;
pub use calibration::*;
pub use campaign::*;
pub use command::*;
pub use control::*;
pub use devices::*;
pub use differences::{SettingDifference, changed_settings, differences};
pub use excitation::*;
pub use interlock::*;
pub use load::validate;
pub use load::{Source, load, whole};
pub use overrides::OptionSetting;
pub use overrides::texts_of_set;
pub use purpose::Purpose;
pub use rig::*;
pub use servo::*;
pub use settings::*;
pub use sim::*;
pub use warnings::warnings;

pub use bench_plant::{
    DampingPoint, DampingSettings, LumpedSettings, ModalSettings, ModeSettings, NodeSettings,
    PlantSettings, SecondaryMassDeviation, SpringSettings, Sr4dofSettings, XyLayout, XySettings,
};

/// The JSON schema of a configuration, made from the types.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(Config).to_value()
}
