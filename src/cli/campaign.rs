//! `bench campaign`: one chirp at each point of a grid of operating points and mass asymmetries (section 5.2.2). On devices a
//! person puts on what each point needs.

use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use super::campaign_attended::OnDevices;
use super::campaign_output::Report;
use super::chirp::check;
use super::error::CliError;
use super::options::BenchOptions;
use super::outcome::Outcome;
use super::output::{print_json, print_text};
use super::progress::ProgressLine;
use super::value_range::ValueRange;
use crate::config::{Config, Purpose, profiles};
use crate::experiment::campaign::{
    Answer, Found, Grid, Place, Point, Store, Tolerances, measured, order, picture, work,
};
use crate::experiment::{self, Plan, Run, stop_on_signal};
use crate::rig::devices;
use crate::rt::thread::Pace;
use crate::util::atomic_file::write_whole;
use crate::util::progress::Progress;
use crate::util::quantity::{OfRatio, si};

/// Section 5.2.2 was identified at 1 kHz; the sweep has to stay below half of that.
const RATE: [&str; 2] = ["loop.rate_hz=1000.0", "chirp.stop_hz=450.0"];

/// Over which grid, and where it is kept.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    /// Operating points as ratios of the beam length
    #[arg(
        long,
        value_name = "FROM:TO:COUNT",
        default_value = "0%:8%:15",
        allow_hyphen_values = true
    )]
    operating_points: ValueRange,
    /// Mass asymmetries m2/m3 - 1 that are put on
    #[arg(
        long,
        value_name = "FROM:TO:COUNT",
        default_value = "-10%:10%:10",
        allow_hyphen_values = true
    )]
    asymmetries: ValueRange,
    /// Folder of the campaign: what is done is kept there, and the same command goes on from it
    #[arg(long, value_name = "DIR", default_value = "campaign")]
    out: PathBuf,
    /// Run on the simulated stage, with the rates, delays and steps of the configured devices
    #[arg(long)]
    simulate: bool,
    /// Keep the recording of each chirp as well, some 9 MB
    #[arg(long)]
    keep_recordings: bool,
    /// How exactly an asymmetry can be put on, for the recommendation [default: half a step of 0.5 g]
    #[arg(long, value_name = "RATIO", value_parser = si::<OfRatio>)]
    asymmetry_tolerance: Option<f64>,
    /// How exactly an operating point can be set, as a ratio of the beam length
    #[arg(long, value_name = "RATIO", default_value_t = 0.002, value_parser = si::<OfRatio>)]
    operating_point_tolerance: f64,
    /// Points at a time [default: one a processor]; the results do not depend on it
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let config = config(args)?;
    let grid = Grid::new(
        args.operating_points.0.clone(),
        args.asymmetries.0.clone(),
        &config,
    )?;
    let tolerances = tolerances(args, &grid, &config)?;
    let Found {
        store,
        mut done,
        dropped,
    } = Store::open(&args.out, &grid, &config, attended(args, &config))?;
    dropped
        .iter()
        .for_each(|why| eprintln!("bench: {why}; the point is measured again"));
    let missing: Vec<Place> = grid
        .places()
        .filter(|place| done.iter().all(|(there, _)| there != place))
        .collect();
    if !done.is_empty() {
        eprintln!(
            "bench: {} of {} points are done already",
            done.len(),
            done.len() + missing.len()
        );
    }
    let bench = Bench {
        config: &config,
        grid: &grid,
        keep: args.keep_recordings,
    };
    let worked = stop_on_signal(|stop| match attended(args, &config) {
        true => {
            let attended = OnDevices {
                bench: &bench,
                store: &store,
                out: &args.out,
                done: &mut done,
            };
            attended.go(&order(&grid, &missing), tolerances.operating_point, stop)
        }
        false => fill(&bench, &store, &missing, &mut done, threads(args), stop),
    });
    worked.map_err(|error| CliError::Failed(error.to_string()))??;
    done.sort_by_key(|(place, _)| *place);
    let all = grid.places().count();
    if done.len() < all {
        let (done, folder) = (done.len(), args.out.display());
        eprintln!(
            "bench: stopped after {done} of {all} points; started again with the same arguments it goes on from {folder}"
        );
        return Ok(Outcome::Failed);
    }
    let answer = Answer::of(&config, &grid, &done, tolerances)?;
    let report = Report::of(
        &answer,
        &draw(args, &config, &answer)?,
        args.bench.profile(),
    );
    if args.bench.json {
        print_json(&report)?
    } else {
        print_text(&report.text())?
    }
    Ok(Outcome::Done)
}

/// Measures what is missing, with progress on a terminal.
fn fill(
    bench: &Bench<'_>,
    store: &Store,
    missing: &[Place],
    done: &mut Vec<(Place, Point)>,
    threads: usize,
    stop: &AtomicBool,
) -> Result<(), CliError> {
    let progress = Progress::default();
    progress.begin("campaign", missing.len() as u64);
    let _line = ProgressLine::show(&progress);
    let measure = |place| bench.measure(place, &store.recordings(place));
    work(missing, threads, stop, measure, |place, point| {
        store.add(place, &point)?;
        done.push((place, point));
        progress.advance(1);
        Ok(())
    })
}

/// Draws the picture into the folder; where it is.
fn draw(args: &Args, config: &Config, answer: &Answer<'_>) -> Result<PathBuf, CliError> {
    let path = args.out.join("campaign.svg");
    let failed = |error: &dyn std::fmt::Display| {
        CliError::Failed(format!(
            "cannot draw {}: {error}; the points are kept",
            path.display()
        ))
    };
    let svg = picture(&config.title, answer).map_err(|error| failed(&error))?;
    write_whole(&path, &svg).map_err(|error| failed(&error))?;
    Ok(path)
}

/// The configuration of the campaign, without what the grid varies.
fn config(args: &Args) -> Result<Config, CliError> {
    let usage = |what: &str| Err(CliError::Usage(what.into()));
    if args.bench.operating_point.is_some() || args.bench.asymmetry.is_some() {
        return usage(
            "--operating-point and --asymmetry fix what a campaign varies: leave them out, or take `bench chirp`",
        );
    }
    let mut bench = args.bench.clone();
    let named = bench
        .config
        .as_deref()
        .is_some_and(|name| name != profiles::DEFAULT);
    let rate = bench
        .sets
        .iter()
        .any(|set| set.trim_start().starts_with("loop.rate_hz"));
    if !named && !rate {
        bench.sets.splice(0..0, RATE.map(String::from));
    }
    let config = bench.load(Purpose::Chirp, &[])?;
    if attended(args, &config) && !std::io::stdin().is_terminal() {
        return usage(
            "the configuration names devices: between the points of a campaign a person is asked for the weight and the masses \
             to put on, and standard input is no terminal; start it in one, or add --simulate, or run `bench chirp \
             --operating-point Y --asymmetry D` at each point",
        );
    }
    if !attended(args, &config) && config.calibration.file.is_some() {
        return usage(
            "`calibration.file` is set, but the simulated stage of a campaign needs no correction; leave it out",
        );
    }
    Ok(config)
}

/// Whether a person loads the stage.
fn attended(args: &Args, config: &Config) -> bool {
    !args.simulate && !devices::is_simulated(config)
}

fn tolerances(args: &Args, grid: &Grid, config: &Config) -> Result<Tolerances, CliError> {
    let half_a_step = || 0.5 * grid.mass_step(config);
    let tolerances = Tolerances {
        asymmetry: args.asymmetry_tolerance.unwrap_or_else(half_a_step),
        operating_point: args.operating_point_tolerance,
    };
    for (what, value) in [
        ("--asymmetry-tolerance", tolerances.asymmetry),
        ("--operating-point-tolerance", tolerances.operating_point),
    ] {
        if !(value > 0.0 && value < 1.0) {
            return Err(CliError::Usage(format!(
                "{what} is {value}; it is a ratio between 0 and 1, as in 0.004"
            )));
        }
    }
    Ok(tolerances)
}

fn threads(args: &Args) -> usize {
    args.threads.map_or_else(
        || std::thread::available_parallelism().map_or(1, usize::from),
        usize::from,
    )
}

/// The stage at any point of a grid.
pub(super) struct Bench<'a> {
    pub config: &'a Config,
    pub grid: &'a Grid,
    pub keep: bool,
}

impl Bench<'_> {
    /// A chirp on the simulated stage at a point.
    fn measure(&self, place: Place, folder: &Path) -> Result<Option<Point>, CliError> {
        self.measure_by(place, folder, |plan| {
            let rig = devices::simulate(&plan.config)?.rig;
            let run = experiment::run(plan, rig, Pace::Virtual, folder, &mut |_, _| {});
            run.map_err(|error| CliError::Failed(error.to_string()))
        })
    }

    /// A chirp at a point, checked, run and analysed as `bench chirp` does it; none where a person stopped the run.
    pub fn measure_by(
        &self,
        place: Place,
        folder: &Path,
        run: impl FnOnce(&Plan) -> Result<Run, CliError>,
    ) -> Result<Option<Point>, CliError> {
        let config = self.grid.config(self.config, place)?;
        check(&config)?;
        // What a process left there that was killed has no result.
        remove(folder)?;
        let plan = Plan::chirp(config);
        let run = run(&plan)?;
        let point = if run.stopped {
            None
        } else {
            Some(point(run, &plan.config)?)
        };
        if point.is_none() || !self.keep {
            remove(folder)?;
        }
        Ok(point)
    }
}

/// What a run says; the recording is closed with that in it.
pub(super) fn point(mut run: Run, config: &Config) -> Result<Point, CliError> {
    let point = measured(&mut run, config)?;
    experiment::close(run, &point)?;
    Ok(point)
}

pub(super) fn remove(folder: &Path) -> Result<(), CliError> {
    match std::fs::remove_dir_all(folder) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(CliError::Failed(format!(
            "cannot remove {}: {e}; remove it and start again",
            folder.display()
        ))),
        _ => Ok(()),
    }
}
