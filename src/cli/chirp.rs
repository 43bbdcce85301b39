//! `bench chirp`: excite, record, estimate the frequency response.

use std::path::Path;

use clap::ValueEnum;
use serde::Serialize;

use super::analysis_output::{self, analysis_failed, open_analyse_and_write, outcome};
use super::error::CliError;
use super::excitation_options::ExcitationOptions;
use super::figure_options::ResponseFigureOptions;
use super::help::with_setting;
use super::options::{BenchOptions, given};
use super::outcome::Outcome;
use super::output::{print_result, print_text, warn};
use super::plan_output;
use super::progress::ProgressLine;
use super::run_options::{RunOptions, close, run_text};
use super::table::{labelled, wrap};
use super::until_decided::{SequenceCommand, SequentialOptions};
use bench_base::progress::Progress;
use bench_base::quantity::Time;
use bench_config::{Config, ExcitationKind, OptionSetting, Purpose, Sweep, warnings};
use bench_excitation::Extremes;
use bench_experiment::sequential::first_shot_config;
use bench_experiment::{
    ExcitationPlan, Plan, RunSummary, abandon_on_signal, check_calibration, predicted_extremes,
};
use bench_report::MagnitudeAxis;
use bench_report::run_pages::{AnalysisOutputs, ExistingFile, ResultFiles};
use bench_rig::devices;

/// The bench and its excitation.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    pub(super) run: RunOptions,
    #[command(flatten)]
    figures: ResponseFigureOptions,
    /// Kind of excitation
    #[arg(long, value_name = "KIND", help = with_setting("Kind of excitation", "excitation.kind"))]
    excitation: Option<ExcitationKind>,
    #[command(flatten)]
    band: ExcitationOptions,
    /// Length of the sweep
    #[arg(long, value_name = "TIME", allow_hyphen_values = true,
        help = with_setting("Length of the sweep", "chirp.duration_s"))]
    duration: Option<Time>,
    /// Frequency as a function of time
    #[arg(long, value_name = "KIND", help = with_setting("Frequency as a function of time", "chirp.sweep"))]
    sweep: Option<Sweep>,
    #[command(flatten)]
    sequential: SequentialOptions,
    /// Only print what the run would do: travel, current, heat, duration; no motion
    #[arg(long)]
    plan: bool,
}

impl Args {
    fn settings(&self) -> Vec<OptionSetting> {
        let duration = given("chirp.duration_s", "--duration", self.duration.as_ref());
        let sweep = self.sweep.map(word);
        let kind = self.excitation.map(word);
        let mut settings = self.band.settings();
        settings.extend(self.run.seed.setting());
        settings.extend(duration);
        settings.extend(sweep.map(|word| word_setting("chirp.sweep", "--sweep", word)));
        settings.extend(kind.map(|word| word_setting("excitation.kind", "--excitation", word)));
        settings
    }

    /// The configuration with the requested amplitude over frequency.
    fn config(&self) -> Result<Config, CliError> {
        let config = self.bench.load(Purpose::Chirp, &self.settings())?;
        self.refuse_unused(&config)?;
        self.band.shaped(config)
    }

    fn sequence(&self) -> SequenceCommand<'_> {
        SequenceCommand {
            bench: &self.bench,
            run: &self.run,
            magnitude_axis: self.figures.magnitude_axis(),
        }
    }

    /// Refuses options of a chirp that have no effect on another kind of excitation.
    fn refuse_unused(&self, config: &Config) -> Result<(), CliError> {
        let kind = config.excitation.kind;
        if kind == ExcitationKind::Chirp {
            return Ok(());
        }
        let (name, chosen) = (kind.name(), config.chosen_excitation());
        let key = chosen.design.length(&chosen.shared).key;
        let unused = match (&self.duration, self.sweep) {
            (Some(duration), _) => {
                format!(
                    "--duration {duration} is the length of a chirp, not of `{name}`; use --set {key}=N"
                )
            }
            (None, Some(_)) => format!(
                "--sweep goes with --excitation chirp only, not with `{name}`; leave it out"
            ),
            (None, None) => return Ok(()),
        };
        Err(CliError::Usage(unused))
    }
}

fn word_setting(key: &str, option: &str, word: String) -> OptionSetting {
    let option = format!("{option} {word}");
    OptionSetting::new(key, word, option)
}

/// The word of a value in help and settings.
fn word(value: impl ValueEnum) -> String {
    let value = value.to_possible_value();
    value.map_or(String::new(), |value| value.get_name().to_string())
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    run: RunSummary,
    expected_travel_m: f64,
    expected: Extremes,
    #[serde(flatten)]
    made: AnalysisOutputs,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let base = args.config()?;
    let max_motion_s = args.sequential.max_motion_s(&base)?;
    let config = match max_motion_s {
        Some(_) => first_shot_config(&base)?,
        None => base.clone(),
    };
    let expected = predicted_extremes(&config)?;
    if args.plan {
        warn(&warnings(&config));
        warn(&check_calibration(&config, args.run.stage(&config))?);
        let mut plan = ExcitationPlan::new(&config, expected);
        plan.motor = args.run.motor_summary(&Plan::chirp(config))?;
        print_result(args.bench.json, &plan, plan_output::text)?;
        return Ok(Outcome::Done);
    }
    match max_motion_s {
        Some(max_motion_s) => args.sequence().measure(&base, max_motion_s),
        None => measure(args, &config, expected),
    }
}

/// Runs the excitation and analyses its recording.
fn measure(args: &Args, config: &Config, expected: Extremes) -> Result<Outcome, CliError> {
    if !args.bench.json {
        print_text(&plan_text(config, &expected))?;
    }
    let mut run = args
        .run
        .run(&args.bench, &Plan::chirp(config.clone()), "chirp")?;
    let summary = RunSummary::of(&mut run)?;
    let made = outputs(&summary, &run.path, config, args.figures.magnitude_axis())?;
    let report = Report {
        run: summary,
        expected_travel_m: expected.travel_m,
        expected,
        made,
    };
    let text = run_text(&report.run, config) + &analysis_output::text(&report.made);
    close(run, &report, args.bench.json, &text)?;
    Ok(outcome(&report.run, &report.made))
}

/// Analyses a run, if it is completed.
pub(super) fn outputs(
    run: &RunSummary,
    path: &Path,
    config: &Config,
    magnitude_axis: MagnitudeAxis,
) -> Result<AnalysisOutputs, CliError> {
    if run.is_completed() {
        analysed(path, config, magnitude_axis)
    } else {
        Ok(AnalysisOutputs::run_incomplete())
    }
}

/// The analysis, which Ctrl-C cancels; the recording stays complete.
fn analysed(
    path: &Path,
    config: &Config,
    magnitude_axis: MagnitudeAxis,
) -> Result<AnalysisOutputs, CliError> {
    let progress = Progress::new("analysing");
    let _line = ProgressLine::show(&progress);
    let (recording, config) = (path.to_path_buf(), config.clone());
    let work = move || {
        let results = ResultFiles {
            beside: &recording,
            existing: ExistingFile::Replace,
        };
        open_analyse_and_write(&recording, &config, results, magnitude_axis, &progress)
    };
    let outputs = abandon_on_signal(work).map_err(|error| CliError::Failed(error.to_string()))?;
    let outputs = outputs.unwrap_or_else(|| Ok(AnalysisOutputs::cancelled()));
    outputs.map_err(|error| analysis_failed(&error, path))
}

/// The plan of the run, printed before it starts.
fn plan_text(config: &Config, expected: &Extremes) -> String {
    let excitation = config.chosen_excitation().describe();
    let travel_um = expected.travel_m * 1e6;
    let plan = format!("{excitation}; expected travel {travel_um:.0} um");
    wrap(&plan, 0) + &unmodelled_text(config)
}

/// A note on the modes of the simulated stage that the model of the plant does not have.
fn unmodelled_text(config: &Config) -> String {
    let unmodelled_hz = unmodelled_hz(config);
    let (Some(lowest), Some(highest)) = (unmodelled_hz.first(), unmodelled_hz.last()) else {
        return String::new();
    };
    let count = unmodelled_hz.len();
    let text = format!(
        "the simulated stage has {count} modes from {lowest} to {highest} Hz that are not part of the model (sim.unmodelled); the analysis finds them as well"
    );
    labelled("note", &text)
}

/// Frequencies of these modes in the band, rising.
fn unmodelled_hz(config: &Config) -> Vec<f64> {
    if !devices::is_simulated(config) {
        return Vec::new();
    }
    let (low_hz, high_hz) = config.chirp.band_hz();
    let modes = config.sim.unmodelled.iter();
    let frequencies = modes.map(|mode| mode.frequency_hz);
    let mut inside: Vec<f64> = frequencies
        .filter(|hz| (low_hz..=high_hz).contains(hz))
        .collect();
    inside.sort_by(f64::total_cmp);
    inside
}
