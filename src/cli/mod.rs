//! The command line: one file a subcommand.

mod analysis_output;
mod calibrate;
mod campaign;
mod campaign_attended;
mod campaign_output;
mod chirp;
mod chirp_plan;
mod columns;
mod config;
mod control;
mod controller_choice;
mod doctor;
mod emulate;
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
mod person;
mod progress;
mod recover;
mod replay;
mod run_options;
mod table;
mod value_range;

use clap::{Parser, Subcommand};

pub use outcome::{CliError, Outcome};

/// A controller daemon for a precision-motion test bench.
///
/// Without a configuration every command works on the simulated stage of the thesis. Exit codes: 0 done, 1 failed (a trip of
/// the interlocks included), 2 wrong usage or configuration, 3 done, but with overruns or lost records, or (identify) of a run
/// that did not come to its end.
#[derive(Debug, Parser)]
#[command(name = "bench", version, max_term_width = 110)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Excite the stage, record, estimate its frequency response: recording, CSV and Bode plot
    Chirp(chirp::Args),
    /// A multisine at several amplitudes: distortion told apart from noise, and whether modes shift with amplitude
    Linearity(linearity::Args),
    /// Close the loop with a reference: recording, predicted and measured figures
    Control(control::Args),
    /// One chirp at each point of a grid of operating points and asymmetries: dots over the map, offset, recommendation
    Campaign(campaign::Args),
    /// Find scale, sign, offset and delay of amplifier and probe by small static steps
    Calibrate(calibrate::Args),
    /// The mechanics by the model: modes, residues, signs, zeros
    Model(model::Args),
    /// Crossover, phase, gain and modulus margin of a controller with the model
    Margins(margins::Args),
    /// The analysis of `bench chirp`, from a recording or from a CSV of other hands
    Identify(identify::Args),
    /// Run the recorded probe through the same loop and compare every command bit for bit
    Replay(replay::Args),
    /// Make a cut-off recording readable and say what was lost
    Recover(recover::Args),
    /// Act as the configured devices, with the simulated stage behind them: a rehearsal without hardware
    Device(emulate::Args),
    /// The effective settings, their validation, their schema
    Config(config::Args),
    /// Could a run start? System, devices, recordings, each finding with its remedy; nothing moves
    Doctor(doctor::Args),
}

/// Runs a parsed command line.
pub fn run(cli: Cli) -> Result<Outcome, CliError> {
    match cli.command {
        Command::Chirp(args) => chirp::run(&args),
        Command::Linearity(args) => linearity::run(&args),
        Command::Control(args) => control::run(&args),
        Command::Campaign(args) => campaign::run(&args),
        Command::Calibrate(args) => calibrate::run(&args),
        Command::Model(args) => model::run(&args),
        Command::Margins(args) => margins::run(&args),
        Command::Identify(args) => identify::run(&args),
        Command::Replay(args) => replay::run(&args),
        Command::Recover(args) => recover::run(&args),
        Command::Device(args) => emulate::run(&args),
        Command::Config(args) => config::run(&args),
        Command::Doctor(args) => doctor::run(&args),
    }
}
