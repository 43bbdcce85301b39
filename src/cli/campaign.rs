//! `bench campaign`: chirps at each point of a grid of operating points and mass asymmetries (section 5.2.2). On devices an
//! operator loads the stage for each point.

use std::io::IsTerminal;
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

use super::campaign_output::Report;
use super::description_options::DescriptionOptions;
use super::error::CliError;
use super::exit::Exit;
use super::operator::TerminalOperator;
use super::output::{print_note, print_result};
use super::progress::ProgressLine;
use bench_base::atomic_file::write_atomic;
use bench_base::progress::Progress;
use bench_base::quantity::Ratio;
use bench_config::{Config, Purpose, profiles};
use bench_experiment::campaign::{
    Campaign, CampaignOptions, Evaluation, Grid, StageModel, Tolerances,
};
use bench_experiment::{ExperimentError, Plan, Run, Runner, Setup, stop_on_signal};
use bench_order::{BenchOptions, CampaignOrder};
use bench_report::campaign_picture;
use bench_rig::devices;

/// The stage of section 5.2.2 was identified at 1 kHz; the sweep must end below half of that.
const RATE: [&str; 2] = ["loop.rate_hz=1000.0", "chirp.stop_hz=450.0"];

/// The order, and the folder of the campaign.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    order: CampaignOrder,
    #[command(flatten)]
    pub description: DescriptionOptions,
    /// Folder of the campaign; the same command continues an interrupted campaign
    #[arg(long, value_name = "DIR", default_value = "campaign")]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let config = config(args)?;
    let grid = grid(args, &config)?;
    let tolerances = tolerances(args, &grid, &config)?;
    let on_devices = is_guided(args, &config);
    let options = CampaignOptions {
        on_devices,
        keep_recordings: args.order.keep_recordings,
        method: args.order.method(),
    };
    let mut campaign = Campaign::open(&args.out, &grid, &config, options)?;
    campaign.description = args.description.description(args.order.bench.profile());
    show_state(&campaign);
    if !campaign.missing().is_empty() {
        measure(args, &mut campaign, &config, tolerances)?;
    }
    if !campaign.missing().is_empty() {
        print_note(&stopped(args, &campaign));
        return Ok(Exit::Failed);
    }
    show(args, &config, &campaign.evaluate(tolerances)?)?;
    Ok(Exit::Done)
}

fn grid(args: &Args, config: &Config) -> Result<Grid, CliError> {
    let beam_length_m = StageModel::of(config)?.stage.beam_length_m;
    let points = args.order.operating_points.ratios(beam_length_m)?;
    Ok(Grid::new(points, args.order.asymmetries.ratios()?, config)?)
}

/// Measures the missing points until all are done, or a signal stops it.
fn measure(
    args: &Args,
    campaign: &mut Campaign<'_>,
    config: &Config,
    tolerances: Tolerances,
) -> Result<(), CliError> {
    let measured = stop_on_signal(|stop| {
        if is_guided(args, config) {
            measure_guided(campaign, config, tolerances, stop)
        } else {
            measure_simulated(campaign, args, stop)
        }
    });
    measured.map_err(ExperimentError::from)?
}

fn show_state(campaign: &Campaign<'_>) {
    for why in &campaign.rejected {
        print_note(&format!("{why}; the point is measured again"));
    }
    if campaign.unverified > 0 {
        print_note(&format!(
            "the files of {} points have no checksum, because an earlier version wrote them, so an altered value is not detected; remove them from the folder points/ to measure these points again",
            campaign.unverified
        ));
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
    Ok(campaign.run_guided(&mut operator, tolerance, &mut run_with_progress, stop)?)
}

/// Runs a plan with progress on a terminal.
fn run_with_progress(
    setup: Setup,
    plan: &Plan,
    phase: &'static str,
) -> Result<Run, ExperimentError> {
    let progress = Progress::new(phase);
    let _line = ProgressLine::show(&progress);
    Runner::with_progress(setup, progress).run(plan, phase)
}

fn show(args: &Args, config: &Config, evaluation: &Evaluation<'_>) -> Result<(), CliError> {
    let picture = draw(args, config, evaluation)?;
    let report = Report::of(
        evaluation,
        &picture,
        args.order.bench.profile(),
        args.description.description(args.order.bench.profile()),
    );
    print_result(args.order.bench.json, &report, Report::text)
}

/// Draws the picture into the folder; returns its path.
fn draw(args: &Args, config: &Config, evaluation: &Evaluation<'_>) -> Result<PathBuf, CliError> {
    let path = args.out.join("campaign.svg");
    let drawn = campaign_picture(&config.title, evaluation).map_err(|error| error.to_string());
    let written = drawn.and_then(|svg| write_atomic(&path, &svg).map_err(|e| e.to_string()));
    written.map_err(|error| {
        let path = path.display();
        CliError::Failed(format!("cannot draw {path}: {error}; start the command again to draw it (the points are stored)"))
    })?;
    Ok(path)
}

/// The configuration of the campaign, without the settings that the grid varies.
fn config(args: &Args) -> Result<Config, CliError> {
    if args.order.bench.operating_point.is_some() || args.order.bench.asymmetry.is_some() {
        return Err(CliError::Usage(
            "--operating-point and --asymmetry cannot be fixed here, because a campaign varies both; leave them out, or use `bench chirp`".into(),
        ));
    }
    let bench = at_rate_of_thesis(&args.order.bench);
    let config = bench.load(Purpose::Chirp, args.order.seed.setting().as_slice())?;
    check_mode(args, &config)?;
    if is_guided(args, &config) {
        args.order.seed.refuse_on_devices()?;
        refuse_threads(args)?;
    }
    Ok(config)
}

/// Refuses `--threads` on devices, where it has no effect.
fn refuse_threads(args: &Args) -> Result<(), CliError> {
    match args.order.threads {
        None => Ok(()),
        Some(_) => Err(CliError::Usage(
            "--threads is valid only for the simulated stage, because on devices one point is measured after the other; leave it out, or add --simulate".into(),
        )),
    }
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

const NO_TERMINAL: &str = "the configuration names devices, so an operator must load the stage for each point of a campaign, and \
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
    !args.order.simulate && !devices::is_simulated(config)
}

fn tolerances(args: &Args, grid: &Grid, config: &Config) -> Result<Tolerances, CliError> {
    let stage = StageModel::of(config)?.stage;
    let half_step = 0.5 * grid.mass_step(stage);
    let asymmetry = args.order.asymmetry_tolerance.as_ref();
    let asymmetry = asymmetry.map_or(half_step, Ratio::si);
    let operating_point = args
        .order
        .operating_point_tolerance
        .ratio(stage.beam_length_m);
    let operating_point = operating_point.map_err(|error| CliError::Usage(error.to_string()))?;
    Ok(Tolerances {
        asymmetry: below_one(
            asymmetry,
            &format!(
                "--asymmetry-tolerance is {asymmetry}; give a ratio between 0 and 1, for example 0.4% or 0.004"
            ),
        )?,
        operating_point: below_one(
            operating_point,
            &format!(
                "--operating-point-tolerance is {}; give a length between 0 and the beam length, for example 0.2% or 0.1mm",
                args.order.operating_point_tolerance
            ),
        )?,
    })
}

/// A ratio above 0 and below 1.
fn below_one(ratio: f64, refusal: &str) -> Result<f64, CliError> {
    if ratio > 0.0 && ratio < 1.0 {
        Ok(ratio)
    } else {
        Err(CliError::Usage(refusal.into()))
    }
}

fn threads(args: &Args) -> usize {
    let processors = || std::thread::available_parallelism().map_or(1, usize::from);
    args.order.threads.map_or_else(processors, usize::from)
}
