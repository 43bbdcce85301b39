//! `bench tune`: designs a controller.

use std::path::{Path, PathBuf};

use super::error::CliError;
use super::exit::Exit;
use super::output::{print_result, warn};
use super::progress::ProgressLine;
use super::tune_measured::{self, SourceOptions};
use super::tune_output::text;
use super::tune_plants::{ModelOptions, model_plants};
use super::tune_values::{
    GoalName, factor, gain_margin, margin, phase_margin_deg, positive, sensitivity_limit,
};
use bench_base::atomic_file::write_atomic;
use bench_base::progress::Progress;
use bench_base::quantity::{OfRatio, OperatingPoint, si};
use bench_base::units::UM_PER_M;
use bench_config::{Config, OptionSetting, Purpose};
use bench_control::tuning::{
    Design, DesignOptions, DesignPlant, DesignTask, Effort, Goal, MarginDisc, PlantFigures,
    Requirements, RigModel, SensitivityLimit, Tolerances, bound_of, design, evaluate, loop_curves,
};
use bench_experiment::tuning::{
    DesignCertificate, DesignExtras, IdentifiedFrf, OppositeAsymmetry, TuneSourceError, evidence,
    recorded_disturbance,
};
use bench_order::{BenchOptions, GLOSSARY};
use bench_plant::SignalPath;
use bench_recording::Recording;
use bench_report::{DesignLimits, DesignPage, ReportError, design_loop_svg, design_nyquist_svg};

/// What is designed, and for which plants.
#[derive(Clone, Debug, clap::Args)]
#[command(mut_arg("operating_point", |arg| arg.hide(true)))]
#[command(after_help = GLOSSARY)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    sources: SourceOptions,
    /// What is best: `disturbance` is the largest slope bandwidth w_s, |S(jw)| <= 0.707 w/w_s for all w <= w_s; `bandwidth`
    /// is the largest frequency up to which |S| <= 0.707; `rms` is the smallest standard deviation of the error
    #[arg(long, value_enum, default_value_t = GoalName::Disturbance)]
    goal: GoalName,
    /// Number of poles of the controller, with that of the integrator
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u8).range(1..=20))]
    order: u8,
    /// Least modulus margin 1/max|S| at all frequencies of all plants
    #[arg(long, value_name = "RATIO", default_value = "0.5", value_parser = margin)]
    modulus_margin: f64,
    /// Least gain margin, a ratio above 1, kept by a disc that L must not enter [default: what the modulus margin guarantees]
    #[arg(long, value_name = "RATIO", value_parser = gain_margin)]
    gain_margin: Option<f64>,
    /// Least phase margin in degrees, kept by the same disc [default: what the modulus margin guarantees]
    #[arg(long, value_name = "DEGREES", value_parser = phase_margin_deg)]
    phase_margin: Option<f64>,
    /// Operating points for which the one controller is designed: lengths, or % of the beam length [default: five points from 0
    /// to the configured one]
    #[arg(long, value_name = "LENGTH,...", value_delimiter = ',', allow_hyphen_values = true, value_parser = OperatingPoint::with_unit)]
    operating_points: Vec<OperatingPoint>,
    /// Upper limit of |S| at a frequency, as 0.141@10rad/s (repeatable)
    #[arg(long, value_name = "RATIO@FREQUENCY", value_parser = sensitivity_limit)]
    max_sensitivity: Vec<SensitivityLimit>,
    /// Upper limit of |K S|, the response from noise to current, in A/um
    #[arg(long, value_name = "A_PER_UM", value_parser = positive)]
    max_control_sensitivity: Option<f64>,
    /// Upper limit of the standard deviation of the current in A, under the disturbance and noise of the configuration; needs the
    /// model
    #[arg(long, value_name = "A", value_parser = positive, conflicts_with_all = ["frf", "campaign"])]
    max_current_rms: Option<f64>,
    /// Recording of a closed loop that held its position (`bench control --reference hold`): its error, without the effect of its
    /// loop, is the disturbance for `--goal rms` and `--max-current-rms` in place of `sim.floor`
    #[arg(long, value_name = "RECORDING", conflicts_with_all = ["frf", "campaign"])]
    disturbance: Option<PathBuf>,
    /// Relative tolerance of the mode frequencies, of the first mode and of all others together
    #[arg(long, value_name = "RATIO", default_value = "1%", value_parser = si::<OfRatio>)]
    frequency_tolerance: f64,
    /// Factor of the damping ratios in the least damped plant
    #[arg(long, value_name = "RATIO", default_value = "0.7", value_parser = factor)]
    damping_factor: f64,
    /// Relative tolerance of the gain, for example of the force constant
    #[arg(long, value_name = "RATIO", default_value = "0", value_parser = si::<OfRatio>)]
    gain_tolerance: f64,
    /// Relative tolerance of the frequencies of modes that the model lacks (sim.unmodelled); their phases are unknown
    #[arg(long, value_name = "RATIO", default_value = "3%", value_parser = si::<OfRatio>)]
    unmodelled_tolerance: f64,
    /// Seed of the search
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Also print which requirement limits the design at which plant and frequency, and what the controller does to the stage with
    /// the opposite mass asymmetry
    #[arg(long)]
    explain: bool,
    /// Leave out the convex bound, the largest value of the goal that a linear controller of any order attains
    #[arg(long)]
    without_bound: bool,
    /// Folder for controller.toml, certificate.json, report.html, loop.svg and nyquist.svg
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let config = args.configuration()?;
    let progress = Progress::new("tune");
    let line = ProgressLine::show(&progress);
    let goal = Goal::from(args.goal);
    let sources = &args.sources;
    let frfs = sources.identified(&args.bench, goal, &config, &progress)?;
    let remarks = tune_measured::remarks(&frfs);
    let task = task(args, &frfs, &config)?;
    let design = design(&task, &progress).inspect_err(|_| warn(&remarks))?;
    let evidence = evidence(&frfs, &design.cascade.sections(), &config)?;
    progress.begin("convex bound", 0);
    let bound = if args.without_bound {
        None
    } else {
        bound_of(&task, design.attained)
    };
    drop(line);
    let opposite = if frfs.is_empty() {
        opposite_asymmetry(args, &config, &task, &design)?
    } else {
        None
    };
    let disturbance = args.disturbance.as_ref();
    let extras = DesignExtras {
        bound,
        opposite,
        frfs: evidence,
        disturbance: disturbance.map(|file| file.display().to_string()),
        remarks,
    };
    let certificate = DesignCertificate::new(args.bench.profile(), &config, &task, &design, extras);
    write(args, &task, &design, &certificate)?;
    print_result(args.bench.json, &certificate, |certificate| {
        text(certificate, args.explain, &args.out)
    })?;
    let missed = design.misses_margin(args.modulus_margin);
    let missed = missed.map(|figures| missed_margin(figures, args.modulus_margin));
    let mut failures: Vec<String> = missed.into_iter().collect();
    failures.extend(tune_measured::failures(
        &certificate.extras.frfs,
        args.modulus_margin,
    ));
    warn(&failures);
    Ok(if failures.is_empty() {
        Exit::Done
    } else {
        Exit::Failed
    })
}

impl Args {
    /// The configuration. With a campaign, --asymmetry chooses its points and is no setting.
    fn configuration(&self) -> Result<Config, CliError> {
        let bench = if self.sources.is_measured() {
            BenchOptions {
                asymmetry: None,
                operating_point: None,
                ..self.bench.clone()
            }
        } else {
            self.bench.clone()
        };
        Ok(bench.load(Purpose::Model, &[])?)
    }
}

/// The task for the measured plants, or for those of the model.
fn task(args: &Args, frfs: &[IdentifiedFrf], config: &Config) -> Result<DesignTask, CliError> {
    let options = options(args)?;
    Ok(if frfs.is_empty() {
        let plants = model_plants(&model_options(args), config, &[])?;
        let task = DesignTask::new(&RigModel::from(config), &plants, options)?;
        match &args.disturbance {
            Some(file) => with_recorded_disturbance(task, file)?,
            None => task,
        }
    } else {
        DesignTask::measured(&tune_measured::plants(frfs), options)?
    })
}

fn model_options(args: &Args) -> ModelOptions<'_> {
    ModelOptions {
        bench: &args.bench,
        operating_points: &args.operating_points,
    }
}

/// The task with the disturbance of a recording.
fn with_recorded_disturbance(task: DesignTask, file: &Path) -> Result<DesignTask, CliError> {
    let recording = Recording::open(file)?;
    let name = file.display().to_string();
    let spectrum = recorded_disturbance(&recording, &name, task.disturbance.noise_rms_m);
    Ok(task.with_disturbance(spectrum.map_err(TuneSourceError::from)?))
}

fn missed_margin(figures: &PlantFigures, least: f64) -> String {
    format!(
        "the modulus margin at {} is {:.4} at {:.0} rad/s, below the limit of {least} (--modulus-margin): the search ended before it fulfilled it; choose another --seed, or a lower --order",
        figures.plant, figures.modulus_margin, figures.modulus_margin_at_rad_s
    )
}

fn options(args: &Args) -> Result<DesignOptions, CliError> {
    let phase_margin_rad = args.phase_margin.map(f64::to_radians);
    let margin_disc = MarginDisc::of(args.modulus_margin, args.gain_margin, phase_margin_rad)
        .map_err(|e| CliError::Usage(e.to_string()))?;
    Ok(DesignOptions {
        requirements: Requirements {
            goal: Goal::from(args.goal),
            modulus_margin: args.modulus_margin,
            max_sensitivity: args.max_sensitivity.clone(),
            max_control_sensitivity_a_per_m: args
                .max_control_sensitivity
                .map(|limit_a_per_um| limit_a_per_um * UM_PER_M),
            margin_disc,
            max_current_rms_a: args.max_current_rms,
        },
        tolerances: Tolerances {
            frequency_ratio: args.frequency_tolerance,
            damping_factor: args.damping_factor,
            gain_ratio: args.gain_tolerance,
        },
        unmodelled_ratio: args.unmodelled_tolerance,
        order: usize::from(args.order),
        effort: Effort::default(),
        seed: args.seed,
    })
}

/// With --explain, the figures of the controller with the opposite mass asymmetry, which changes the signs of the residues.
fn opposite_asymmetry(
    args: &Args,
    config: &Config,
    task: &DesignTask,
    design: &Design,
) -> Result<Option<OppositeAsymmetry>, CliError> {
    let asymmetry = config
        .plant
        .mass_asymmetry()
        .filter(|d| *d != 0.0 && args.explain);
    let Some(asymmetry) = asymmetry.map(|d| -d) else {
        return Ok(None);
    };
    let setting = OptionSetting::new("plant.mass_asymmetry", asymmetry, "--explain");
    let plants = model_plants(&model_options(args), config, &[setting])?;
    let path = SignalPath::from(config);
    let plants = plants.into_iter();
    let plants: Vec<_> = plants
        .map(|p| DesignPlant::new(p.name, &path, p.modes))
        .collect();
    Ok(Some(OppositeAsymmetry {
        mass_asymmetry: asymmetry,
        plants: evaluate(task, &design.cascade, &plants),
    }))
}

/// Writes all files of the design.
fn write(
    args: &Args,
    task: &DesignTask,
    design: &Design,
    certificate: &DesignCertificate,
) -> Result<(), CliError> {
    let failed = |what: String| CliError::Failed(what);
    std::fs::create_dir_all(&args.out).map_err(|e| cannot_write(&args.out, &e))?;
    let json = serde_json::to_string_pretty(certificate);
    let json = json.map_err(|e| {
        failed(format!(
            "the certificate cannot be written as JSON, so no file was written: {e}"
        ))
    })?;
    let curves = loop_curves(task, design);
    let limits = DesignLimits::of(&task.requirements, design.attained);
    let title = certificate.title();
    let picture = |svg: Result<String, ReportError>| svg.map_err(|e| failed(e.to_string()));
    let loop_svg = picture(design_loop_svg(&curves, limits, &title))?;
    let nyquist_svg = picture(design_nyquist_svg(&curves, limits, &title))?;
    let page = DesignPage {
        certificate,
        loop_svg: &loop_svg,
        nyquist_svg: &nyquist_svg,
    };
    let page = page.html();
    let files = [
        ("controller.toml", certificate.controller_file()),
        ("certificate.json", json + "\n"),
        ("report.html", page),
        ("loop.svg", loop_svg),
        ("nyquist.svg", nyquist_svg),
    ];
    for (name, text) in files {
        let path = args.out.join(name);
        write_atomic(&path, &text).map_err(|e| cannot_write(&path, &e))?;
    }
    Ok(())
}

fn cannot_write(path: &Path, error: &std::io::Error) -> CliError {
    CliError::Failed(format!(
        "cannot write {}: {error}; choose another folder with --out",
        path.display()
    ))
}
