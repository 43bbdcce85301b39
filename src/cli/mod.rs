//! The command line: one file a subcommand.

mod analysis_output;
mod calibrate;
mod campaign;
mod campaign_attended;
mod campaign_output;
mod chirp;
mod chirp_plan;
mod columns;
mod command;
mod config;
mod control;
mod controller_choice;
mod doctor;
mod emulate;
mod error;
mod identify;
mod identify_external;
mod linearity;
mod linearity_output;
mod loop_output;
mod margins;
mod modal_output;
mod model;
mod options;
mod outcome;
mod output;
mod person;
mod progress;
mod recover;
mod replay;
mod run_options;
mod table;
mod value_range;

pub use command::{Cli, main, run};
pub use error::{CliError, ErrorKind};
pub use outcome::Outcome;
