//! What a client may ask a bench to do.
//!
//! An [`Order`] is a command with its options. The command line fills it, a client of the daemon sends it as JSON, and the queue of the
//! daemon holds it. It says what is wanted; where the recordings go, and who carries it out, is decided by whoever takes it.
//!
//! | module | for |
//! |---|---|
//! | `order` | the commands, and an order of each |
//! | `from_json` | an order from JSON, and the JSON schema |
//! | `words` | the words of a command line for options in JSON |
//! | `chirp`, `control`, `calibrate`, `linearity`, `campaign`, `identify` | the options of each command, and the configuration that they select |
//! | `bench_options`, `rig_options`, `excitation_options`, `figure_options`, `controller_choice` | options that several commands share |
//! | `response_options`, `response_identification` | a frequency response in place of signals |
//! | `reference` | the value of `--reference` |
//! | `value_range` | a grid as typed |
//! | `help` | texts of options with the value of the default profile |

#![deny(unsafe_code)]

mod bench_options;
mod calibrate;
mod campaign;
mod chirp;
mod control;
mod controller_choice;
mod excitation_options;
mod figure_options;
mod from_json;
mod help;
mod identify;
mod linearity;
mod order;
mod path_text;
mod reference;
mod response_identification;
mod response_options;
mod rig_options;
#[cfg(test)]
mod tests;
mod value_range;
mod words;

pub use bench_options::{BenchOptions, SeedOption, given};
pub use calibrate::CalibrateOrder;
pub use campaign::CampaignOrder;
pub use chirp::{ChirpOrder, SequentialOptions};
pub use control::{ControlOrder, Shaper, defaults_help};
pub use controller_choice::ControllerChoice;
pub use excitation_options::ExcitationOptions;
pub use figure_options::ResponseFigureOptions;
pub use from_json::{OrderError, order_schema, refused_option, usage_message};
pub use help::{GLOSSARY, default_value, with_setting};
pub use identify::{ColumnsError, ExternalOptions, Hold, IdentifyOrder};
pub use linearity::LinearityOrder;
pub use order::{Command, Order};
pub use reference::{Reference, ReferenceKind};
pub use response_options::ResponseOptions;
pub use rig_options::RigOptions;
pub use value_range::{ValueRange, asymmetries, operating_points};
