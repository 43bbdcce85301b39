//! `bench campaign`: one chirp at each point of a grid of operating points and mass asymmetries (section 5.2.2). On devices an
//! operator loads the stage for each point.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use super::campaign_output::Report;
use super::error::CliError;
use super::operator::TerminalOperator;
use super::options::BenchOptions;
use super::outcome::Outcome;
use super::output::{print_note, print_result};
use super::progress::ProgressLine;
use super::value_range::ValueRange;
use crate::config::{Config, Purpose, profiles};
use crate::experiment::campaign::{Campaign, Evaluation, Grid, StageModel, Tolerances};
use crate::experiment::{ExperimentError, Plan, Run, Runner, Setup, stop_on_signal};
use crate::report::campaign_picture;
use crate::rig::devices;
use crate::util::atomic_file::write_atomic;
use crate::util::progress::Progress;
use crate::util::quantity::{OfRatio, si};

/// The stage of section 5.2.2 was identified at 1 kHz; the sweep must end below half of that.
const RATE: [&str; 2] = ["loop.rate_hz=1000.0", "chirp.stop_hz=450.0"];

/// Arguments of the command.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// Operating points, in % or as a ratio of the beam length
    #[arg(
        long,
        value_name = "FROM:TO:COUNT",
        default_value = "0%:8%:15",
        allow_hyphen_values = true
    )]
    operating_points: ValueRange,
    /// Nominal mass asymmetries m2/m3 - 1 (without the asymmetry offset of the stage)
    #[arg(
        long,
        value_name = "FROM:TO:COUNT",
        default_value = "-10%:10%:10",
        allow_hyphen_values = true
    )]
    asymmetries: ValueRange,
    /// Folder of the campaign; the same command continues an interrupted campaign
    #[arg(long, value_name = "DIR", default_value = "campaign")]
    out: PathBuf,
    /// Run on the simulated stage, with the rates, delays and resolution of the configured devices
    #[arg(long)]
    simulate: bool,
    /// Keep the recording of each chirp as well, about 9 MB each
    #[arg(long)]
    keep_recordings: bool,
    /// Accuracy with which an asymmetry can be set, for the recommendation [default: 0.25 g
    /// divided by m3, half of a mass step of 0.5 g]
    #[arg(long, value_name = "RATIO", value_parser = si::<OfRatio>)]
    asymmetry_tolerance: Option<f64>,
    /// Accuracy with which an operating point can be set, as a ratio of the beam length
    #[arg(long, value_name = "RATIO", default_value_t = 0.002, value_parser = si::<OfRatio>)]
    operating_point_tolerance: f64,
    /// Number of points simulated in parallel [default: one for each processor]; the results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let config = config(args)?;
    let (points, asymmetries) = (args.operating_points.0.clone(), args.asymmetries.0.clone());
    let grid = Grid::new(points, asymmetries, &config)?;
    let tolerances = tolerances(args, &grid, &config)?;
    let on_devices = is_guided(args, &config);
    let mut campaign = Campaign::open(&args.out, &grid, &config, on_devices, args.keep_recordings)?;
    show_state(&campaign);
    if !campaign.missing().is_empty() {
        measure(args, &mut campaign, &config, tolerances)?;
    }
    if !campaign.missing().is_empty() {
        print_note(&stopped(args, &campaign));
        return Ok(Outcome::Failed);
    }
    show(args, &config, &campaign.evaluate(tolerances)?)?;
    Ok(Outcome::Done)
}

/// Measures the missing points until all are done, or a signal stops it.
fn measure(
    args: &Args,
    campaign: &mut Campaign<'_>,
    config: &Config,
    tolerances: Tolerances,
) -> Result<(), CliError> {
    let measured = stop_on_signal(|stop| match is_guided(args, config) {
        true => measure_guided(campaign, config, tolerances, stop),
        false => measure_simulated(campaign, args, stop),
    });
    measured.map_err(ExperimentError::from)?
}

fn show_state(campaign: &Campaign<'_>) {
    for why in &campaign.rejected {
        print_note(&format!("{why}; the point is measured again"));
    }
    let (done, missing) = (campaign.done().len(), campaign.missing().len());
    if done > 0 {
        print_note(&format!(
            "{done} of {} points are finished already",
            done + missing
        ));
    }
}

fn stopped(args: &Args, campaign: &Campaign<'_>) -> String {
    let (done, missing) = (campaign.done().len(), campaign.missing().len());
    format!(
        "stopped after {done} of {} points; the same command continues from {}",
        done + missing,
        args.out.display()
    )
}

/// Measures the missing points, with progress on a terminal.
fn measure_simulated(
    campaign: &mut Campaign<'_>,
    args: &Args,
    stop: &AtomicBool,
) -> Result<(), CliError> {
    let progress = Progress::default();
    let _line = ProgressLine::show(&progress);
    Ok(campaign.run_simulated(threads(args), &progress, stop)?)
}

/// Measures the missing points with the operator at the terminal.
fn measure_guided(
    campaign: &mut Campaign<'_>,
    config: &Config,
    tolerances: Tolerances,
    stop: &AtomicBool,
) -> Result<(), CliError> {
    let mut operator = TerminalOperator::new(stop, config.plant.beam_length_m())?;
    let tolerance = tolerances.operating_point;
    Ok(campaign.run_guided(&mut operator, tolerance, &mut run_with_progress)?)
}

/// Runs a plan with progress on a terminal.
fn run_with_progress(
    setup: Setup,
    plan: &Plan,
    phase: &'static str,
) -> Result<Run, ExperimentError> {
    let progress = Progress::new(phase);
    let _line = ProgressLine::show(&progress);
    Runner { setup, progress }.run(plan, phase)
}

fn show(args: &Args, config: &Config, evaluation: &Evaluation<'_>) -> Result<(), CliError> {
    let picture = draw(args, config, evaluation)?;
    let report = Report::of(evaluation, &picture, args.bench.profile());
    print_result(args.bench.json, &report, Report::text)
}

/// Draws the picture into the folder; returns its path.
fn draw(args: &Args, config: &Config, evaluation: &Evaluation<'_>) -> Result<PathBuf, CliError> {
    let path = args.out.join("campaign.svg");
    let drawn = campaign_picture(&config.title, evaluation).map_err(|error| error.to_string());
    let written = drawn.and_then(|svg| write_atomic(&path, &svg).map_err(|e| e.to_string()));
    written.map_err(|error| {
        let path = path.display();
        CliError::Failed(format!("cannot draw {path}: {error}; the points are kept"))
    })?;
    Ok(path)
}

/// The configuration of the campaign, without the settings that the grid varies.
fn config(args: &Args) -> Result<Config, CliError> {
    if args.bench.operating_point.is_some() || args.bench.asymmetry.is_some() {
        return Err(CliError::Usage(
            "--operating-point and --asymmetry set what a campaign varies: leave them out, or use `bench chirp`".into(),
        ));
    }
    let config = at_rate_of_thesis(&args.bench).load(Purpose::Chirp, &[])?;
    check_mode(args, &config)?;
    Ok(config)
}

/// The default profile at the rate of section 5.2.2, unless another rate is set.
fn at_rate_of_thesis(bench: &BenchOptions) -> BenchOptions {
    let mut bench = bench.clone();
    let is_rate = |set: &String| set.trim_start().starts_with("loop.rate_hz");
    if bench.profile() == profiles::DEFAULT && !bench.sets.iter().any(is_rate) {
        bench.sets.splice(0..0, RATE.map(String::from));
    }
    bench
}

const NO_TERMINAL: &str = "the configuration names devices: an operator must load the stage for each point of a campaign, and \
    standard input is not a terminal; start it in a terminal, or add --simulate, or run `bench chirp \
    --operating-point Y --asymmetry D` at each point";
const CALIBRATED_SIMULATION: &str = "`calibration.file` is set, but the simulated stage of a campaign needs no correction; leave it out";

/// Refuses a guided campaign without a terminal, and a simulated one with a calibration.
fn check_mode(args: &Args, config: &Config) -> Result<(), CliError> {
    let refusal = match is_guided(args, config) {
        true if !std::io::stdin().is_terminal() => NO_TERMINAL,
        false if config.calibration.file.is_some() => CALIBRATED_SIMULATION,
        _ => return Ok(()),
    };
    Err(CliError::Usage(refusal.into()))
}

/// Whether an operator loads the stage.
fn is_guided(args: &Args, config: &Config) -> bool {
    !args.simulate && !devices::is_simulated(config)
}

fn tolerances(args: &Args, grid: &Grid, config: &Config) -> Result<Tolerances, CliError> {
    let half_step = 0.5 * grid.mass_step(StageModel::of(config)?.stage);
    let asymmetry = args.asymmetry_tolerance.unwrap_or(half_step);
    Ok(Tolerances {
        asymmetry: ratio("--asymmetry-tolerance", asymmetry)?,
        operating_point: ratio(
            "--operating-point-tolerance",
            args.operating_point_tolerance,
        )?,
    })
}

fn ratio(option: &str, value: f64) -> Result<f64, CliError> {
    if value > 0.0 && value < 1.0 {
        return Ok(value);
    }
    Err(CliError::Usage(format!(
        "{option} is {value}; it is a ratio between 0 and 1, for example 0.004"
    )))
}

fn threads(args: &Args) -> usize {
    let processors = || std::thread::available_parallelism().map_or(1, usize::from);
    args.threads.map_or_else(processors, usize::from)
}
