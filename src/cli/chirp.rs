//! `bench chirp`: excite, record, estimate the frequency response.

use std::path::Path;

use serde::Serialize;

use super::analysis_output::{self, analysis_exit, analysis_failed, open_analyse_and_write};
use super::error::CliError;
use super::exit::Exit;
use super::figure_options::magnitude_axis;
use super::output::{print_result, print_text, warn};
use super::plan_output;
use super::progress::ProgressLine;
use super::run_options::{RunCommand, RunOptions, close, run_text};
use super::table::{labelled, wrap};
use super::until_decided::SequenceCommand;
use bench_base::progress::Progress;
use bench_config::{Config, warnings};
use bench_excitation::Extremes;
use bench_experiment::outputs::{AnalysisOutputs, ExistingFile, ResultFiles};
use bench_experiment::sequential::first_shot_config;
use bench_experiment::{
    ExcitationPlan, Plan, RunSummary, abandon_on_signal, check_calibration, predicted_extremes,
};
use bench_order::{ChirpOrder, Order};
use bench_report::MagnitudeAxis;
use bench_rig::devices;

/// The order, and where its recording goes.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    order: ChirpOrder,
    #[command(flatten)]
    pub(super) run: RunOptions,
    /// Only print what the run would do: travel, current, heat, duration; no motion
    #[arg(long)]
    plan: bool,
}

impl Args {
    /// The command with its order.
    pub(super) fn command(&self) -> RunCommand<'_> {
        RunCommand {
            order: Order::Chirp(self.order.clone()),
            options: &self.run,
            is_plan: self.plan,
        }
    }

    fn sequence(&self) -> SequenceCommand<'_> {
        SequenceCommand {
            command: self.command(),
            magnitude_axis: magnitude_axis(self.order.figures),
        }
    }
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

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let base = args.order.config()?;
    let max_motion_s = args.order.sequential.max_motion_s(&base)?;
    let config = match max_motion_s {
        Some(_) => first_shot_config(&base)?,
        None => base.clone(),
    };
    let expected = predicted_extremes(&config)?;
    if args.plan {
        warn(&warnings(&config));
        warn(&check_calibration(&config, args.order.rig.stage(&config))?);
        let mut plan = ExcitationPlan::new(&config, expected)?;
        plan.motor = args.order.rig.motor_summary(&Plan::chirp(config))?;
        print_result(args.order.bench.json, &plan, plan_output::text)?;
        return Ok(Exit::Done);
    }
    match max_motion_s {
        Some(max_motion_s) => args.sequence().measure(&base, max_motion_s),
        None => measure(args, &config, expected),
    }
}

/// Runs the excitation and analyses its recording.
fn measure(args: &Args, config: &Config, expected: Extremes) -> Result<Exit, CliError> {
    if !args.order.bench.json {
        print_text(&plan_text(config, &expected))?;
    }
    let mut run = args.command().run(&Plan::chirp(config.clone()), "chirp")?;
    let summary = RunSummary::of(&mut run)?;
    let made = outputs(
        &summary,
        &run.path,
        config,
        magnitude_axis(args.order.figures),
    )?;
    let report = Report {
        run: summary,
        expected_travel_m: expected.travel_m,
        expected,
        made,
    };
    let text = run_text(&report.run, config) + &analysis_output::text(&report.made);
    close(run, &report, args.order.bench.json, &text)?;
    Ok(analysis_exit(&report.run, &report.made))
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
    let excitation = config.excitation_text();
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
