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

mod campaign;
mod check;
mod devices;
mod excitation;
mod excited;
mod load;
mod place;
mod plant;
pub mod profiles;
pub mod quantity;
mod relations;
mod settings;

pub use campaign::*;
pub(crate) use check::nearest;
pub use devices::*;
pub use excitation::*;
pub use load::{ConfigError, Purpose, Source, load, whole};
pub(crate) use load::{recheck, text_of, text_of_file, typed};
pub use plant::*;
pub(crate) use relations::relations_of;
pub use settings::*;

/// The JSON schema of a configuration, made from the types.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(Config).to_value()
}
