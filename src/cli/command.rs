//! The commands and their dispatch.

use clap::{CommandFactory, Parser, Subcommand};

use super::error::{CliError, ErrorReport};
use super::exit::Exit;
use super::output::{print_json, print_note};
use super::run_options::RunCommand;
use super::{
    calibrate, campaign, chirp, compare, completions, config, control, controller, doctor, emulate,
    export, identify, linearity, margins, model, recover, remote, replay, report, resume, serve,
    tune,
};
use bench_experiment::survive_file_size_limit;
use bench_order::GLOSSARY;

/// Identifies and controls a precision-motion stage.
///
/// Without `--config`, every run uses the simulated stage of the thesis. Exit codes: 0 success; 1 failure, for example
/// an interlock trip; 2 wrong usage or configuration, no motion; 3 success, but with overruns or lost records
/// (identify: the recorded run was not completed; recover: something is missing).
#[derive(Debug, Parser)]
#[command(name = "bench", version, max_term_width = 80, after_help = GLOSSARY)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Excite the stage and estimate its frequency response; writes a recording, a CSV file and a Bode plot
    Chirp(chirp::Args),
    /// Run a multisine at several amplitudes: separates distortion from noise and detects amplitude-dependent modes
    Linearity(linearity::Args),
    /// Run the closed loop with a reference signal; writes a recording and prints predicted and measured settling time,
    /// overshoot and error
    Control(Box<control::Args>),
    /// Run as a daemon that owns the bench: live page, HTTP interface, queue of commands; other `bench` commands on this
    /// machine then use its bench
    Serve(serve::Args),
    /// Release the bench of a daemon after a stop or a trip, and acknowledge the trip: waiting commands then begin
    Resume(resume::Args),
    /// Run a chirp at each point of a grid of operating points and asymmetries; prints a map of the verdicts, the
    /// asymmetry offset and a recommendation
    Campaign(campaign::Args),
    /// Measure scale, sign and offset of amplifier and probe with small static steps, and the delay with a chirp; the
    /// stage moves
    Calibrate(calibrate::Args),
    /// Analyse the model of the mechanics: modes, residues, signs, zeros
    Model(model::Args),
    /// Compute crossover, phase margin, gain margin and modulus margin of a controller with the model; exit code 1 if the
    /// loop is unstable
    Margins(margins::Args),
    /// Convert a controller that was designed with MATLAB or Python (MAT-file, numpy archive, JSON) to a controller file
    Controller(controller::Args),
    /// Design a controller for several operating points with tolerances; writes the controller file, a certificate and plots
    Tune(tune::Args),
    /// Analyse a recording, an external CSV file, or a frequency response of another program (--frf) with the same method as
    /// `bench chirp`
    Identify(identify::Args),
    /// Write the page of a recording of any run, or one page with the frequency responses and steps of several recordings
    Report(report::Args),
    /// Write the signals or the frequency response of a recording as CSV, Parquet, MATLAB or UFF 58
    Export(export::Args),
    /// Compare recordings with the first one: modes, verdict, static compliance and figures of the loop, with the
    /// significance of each difference
    Compare(compare::Args),
    /// Feed the recorded probe measurements to the loop code again and compare every command bit for bit
    Replay(replay::Args),
    /// Write a readable copy of a truncated or damaged recording and report what was lost
    Recover(recover::Args),
    /// Emulate the configured devices with the simulated stage, to test a run without hardware
    #[command(alias = "device")]
    Emulate(emulate::Args),
    /// Show and check settings, print their schema, list profiles, write a template for your own stage
    Config(config::Args),
    /// Check whether a run can start (system, devices, recordings) and print a remedy for each problem; no motion
    Doctor(doctor::Args),
    /// Print the completion script for a shell
    Completions(completions::CompletionArgs),
    /// Print or write the manual pages
    Man(completions::ManArgs),
}

impl Command {
    /// A command that makes runs and can be carried out by the daemon of another machine.
    fn run_command(&self) -> Option<RunCommand<'_>> {
        match self {
            Command::Chirp(args) => Some(args.command()),
            Command::Linearity(args) => Some(args.command()),
            Command::Control(args) => Some(args.command()),
            Command::Calibrate(args) => Some(args.command()),
            _ => None,
        }
    }
}

/// Parses the arguments of the process, runs the command and reports an error: as text on standard error and, with
/// `--json`, as an object on standard output.
pub fn main() -> Exit {
    // Without the handler a write beyond `ulimit -f` ends the process; the program works without it.
    let _ = survive_file_size_limit();
    let json = std::env::args_os().any(|argument| argument == "--json");
    match Cli::try_parse() {
        Ok(cli) => run_here_or_there(cli).unwrap_or_else(|error| failed(&error, json)),
        Err(error) => not_parsed(&error, json),
    }
}

/// Runs a parsed command line in this process, or at the daemon that it names.
fn run_here_or_there(cli: Cli) -> Result<Exit, CliError> {
    if let Some(command) = cli.command.run_command()
        && let Some(target) = command.remote()?
    {
        return remote::carry_out(&target, &command.order, &command.options.description);
    }
    run(cli)
}

fn failed(error: &CliError, json: bool) -> Exit {
    if json {
        print_report(&ErrorReport::of(error))
    } else {
        print_note(&error.to_string())
    }
    error.exit()
}

/// Help and version are requests, everything else is wrong usage.
fn not_parsed(error: &clap::Error, json: bool) -> Exit {
    let is_request = error.exit_code() == 0;
    if json && !is_request {
        print_report(&ErrorReport::of_usage(error))
    } else {
        drop(error.print())
    }
    if is_request { Exit::Done } else { Exit::Usage }
}

/// The message on standard error, the object on standard output.
fn print_report(report: &ErrorReport) {
    print_note(report.message());
    // If standard output is closed, the exit code still reports the failure.
    let _ = print_json(report);
}

/// Runs a parsed command line.
pub fn run(cli: Cli) -> Result<Exit, CliError> {
    match cli.command {
        Command::Chirp(args) => chirp::run(&args),
        Command::Linearity(args) => linearity::run(&args),
        Command::Control(args) => control::run(&args),
        Command::Serve(args) => serve::run(&args),
        Command::Resume(args) => resume::run(&args),
        Command::Campaign(args) => campaign::run(&args),
        Command::Calibrate(args) => calibrate::run(&args),
        Command::Model(args) => model::run(&args),
        Command::Margins(args) => margins::run(&args),
        Command::Controller(args) => controller::run(&args),
        Command::Tune(args) => tune::run(&args),
        Command::Identify(args) => identify::run(&args),
        Command::Report(args) => report::run(&args),
        Command::Export(args) => export::run(&args),
        Command::Compare(args) => compare::run(&args),
        Command::Replay(args) => replay::run(&args),
        Command::Recover(args) => recover::run(&args),
        Command::Emulate(args) => emulate::run(&args),
        Command::Config(args) => config::run(&args),
        Command::Doctor(args) => doctor::run(&args),
        Command::Completions(args) => completions::run_completions(&args, Cli::command()),
        Command::Man(args) => completions::run_man(&args, Cli::command()),
    }
}
