//! `bench chirp`: excite, record, estimate the frequency response.

use std::path::Path;

use clap::ValueEnum;
use serde::Serialize;

use super::analysis_output::{self, analyse_and_write};
use super::error::CliError;
use super::excitation_options::ExcitationOptions;
use super::help::with_setting;
use super::options::BenchOptions;
use super::outcome::Outcome;
use super::output::{print_json, print_text};
use super::plan_output;
use super::progress::ProgressLine;
use super::run_options::{RunOptions, close, exit, run_text};
use super::table::{labelled, wrap};
use crate::config::{Config, ExcitationKind, OptionSetting, Purpose, Sweep};
use crate::excitation::Extremes;
use crate::experiment::{ExcitationPlan, Plan, RunSummary, abandon_on_signal, predicted_extremes};
use crate::recording::Recording;
use crate::report::run_pages::AnalysisOutputs;
use crate::rig::devices;
use crate::util::progress::Progress;
use crate::util::quantity::Time;

/// Which bench, and how to excite it.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    bench: BenchOptions,
    #[command(flatten)]
    run: RunOptions,
    /// What to excite with
    #[arg(long, value_name = "KIND", help = with_setting("What to excite with", "excitation.kind"))]
    excitation: Option<ExcitationKind>,
    #[command(flatten)]
    band: ExcitationOptions,
    /// Length of the sweep
    #[arg(long, value_name = "TIME", allow_hyphen_values = true,
        help = with_setting("Length of the sweep", "chirp.duration_s"))]
    duration: Option<Time>,
    /// Frequency over time
    #[arg(long, value_name = "KIND", help = with_setting("Frequency over time", "chirp.sweep"))]
    sweep: Option<Sweep>,
    /// Only print what the run would do: travel, current, heat, duration; no motion
    #[arg(long)]
    plan: bool,
}

impl Args {
    fn settings(&self) -> Vec<OptionSetting> {
        let mut settings = self.band.settings();
        if let Some(duration) = &self.duration {
            let option = format!("--duration {duration}");
            settings.push(OptionSetting::new(
                "chirp.duration_s",
                duration.si(),
                option,
            ));
        }
        if let Some(sweep) = self.sweep {
            let option = format!("--sweep {}", word(sweep));
            settings.push(OptionSetting::new("chirp.sweep", word(sweep), option));
        }
        if let Some(kind) = self.excitation {
            let option = format!("--excitation {}", word(kind));
            settings.push(OptionSetting::new("excitation.kind", word(kind), option));
        }
        settings
    }

    /// The configuration with the requested amplitude over frequency.
    fn config(&self) -> Result<Config, CliError> {
        let config = self.bench.load(Purpose::Chirp, &self.settings())?;
        self.band.shaped(config)
    }
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
    let config = args.config()?;
    let expected = predicted_extremes(&config)?;
    if args.plan {
        return show(&ExcitationPlan::new(&config, expected), args.bench.json);
    }
    if !args.bench.json {
        print_text(&plan_text(&config, &expected))?;
    }
    let plan = Plan::chirp(config.clone());
    let mut run = args.run.run(&plan, "chirp")?;
    let report = RunSummary::of(&mut run)?;
    let made = match report.is_completed() {
        true => analysed(&run.path, &config)?,
        false => AnalysisOutputs::run_incomplete(),
    };
    let report = Report {
        run: report,
        expected_travel_m: expected.travel_m,
        expected,
        made,
    };
    let text = run_text(&report.run, &config) + &analysis_output::text(&report.made);
    close(run, &report, args.bench.json, &text)?;
    Ok(if report.made.is_cancelled() {
        Outcome::Failed
    } else {
        exit(&report.run)
    })
}

/// The analysis, which can be cancelled: the recording is complete all the same.
pub(super) fn analysed(path: &Path, config: &Config) -> Result<AnalysisOutputs, CliError> {
    let progress = Progress::new("analysing");
    let _line = ProgressLine::show(&progress);
    let (recording, config) = (path.to_path_buf(), config.clone());
    let work = move || {
        let opened = Recording::open(&recording)?;
        analyse_and_write(&opened, &config, &recording, &progress)
    };
    let outputs = abandon_on_signal(work).map_err(|error| CliError::Failed(error.to_string()))?;
    let outputs = outputs.unwrap_or_else(|| Ok(AnalysisOutputs::cancelled()));
    outputs.map_err(|error| {
        let path = path.display();
        CliError::Failed(format!(
            "{error}; the recording of the run is complete: {path}"
        ))
    })
}

/// Prints what the run would do.
fn show(plan: &ExcitationPlan, json: bool) -> Result<Outcome, CliError> {
    match json {
        true => print_json(plan)?,
        false => print_text(&plan_output::text(plan))?,
    }
    Ok(Outcome::Done)
}

/// What the run will do, printed before it starts.
fn plan_text(config: &Config, expected: &Extremes) -> String {
    let (words, travel_um) = (
        config.chosen_excitation().describe(),
        expected.travel_m * 1e6,
    );
    let plan = wrap(&format!("{words}; expected travel {travel_um:.0} um"), 0);
    plan + &unmodelled_text(config)
}

/// Modes of the simulated stage that the model of the plant does not have.
fn unmodelled_text(config: &Config) -> String {
    let frequencies = config.sim.unmodelled.iter().map(|mode| mode.frequency_hz);
    let (low_hz, high_hz) = config.chirp.band_hz();
    let inside: Vec<f64> = frequencies
        .filter(|hz| (low_hz..=high_hz).contains(hz))
        .collect();
    if inside.is_empty() || !devices::is_simulated(config) {
        return String::new();
    }
    let (count, lowest) = (
        inside.len(),
        inside.iter().copied().fold(f64::INFINITY, f64::min),
    );
    let highest = inside.iter().copied().fold(0.0, f64::max);
    let text = format!(
        "the simulated stage has {count} modes from {lowest} to {highest} Hz that are not part of the model (sim.unmodelled); the analysis finds them as well"
    );
    labelled("note", &text)
}
