//! Settings as TOML files.
//!
//! The types of the settings define everything about a key: the schema is made from them, and a text is checked against
//! that schema, so that an error names the file, the line, the key, the limit and the remedy.
//!
//! ```
//! use schemars::JsonSchema;
//! use serde::Deserialize;
//!
//! #[derive(Debug, Deserialize, JsonSchema)]
//! #[schemars(extend("additionalProperties" = false))]
//! struct Notch {
//!     /// Frequency in Hz.
//!     #[schemars(range(min = 1.0, max = 1000.0))]
//!     frequency_hz: f64,
//! }
//!
//! let error = bench_settings::typed::<Notch>("notch.toml", "frequency_hz = 2e3").unwrap_err();
//! assert!(error.to_string().contains("notch.toml line 1: `frequency_hz` is 2000 Hz; give a value from 1 to 1000 Hz"));
//! # Ok::<(), bench_settings::ConfigError>(())
//! ```

#![deny(unsafe_code)]

pub mod check;
mod error;
pub mod files;
pub mod layer;
mod place;
mod typed;

pub use error::{ConfigError, MAX_ERRORS};
pub use files::{EmbeddedFile, text_of, text_of_file};
pub use typed::typed;
