//! `bench linearity`: the same multisine at several amplitudes.

use std::path::Path;

use serde::Serialize;

use super::analysis_output;
use super::analysis_output::analysis_exit;
use super::chirp::outputs;
use super::error::CliError;
use super::exit::Exit;
use super::figure_options::magnitude_axis;
use super::linearity_output;
use super::output::{print_result, print_text};
use super::progress::ProgressLine;
use super::run_options::{RunCommand, RunOptions, run_text};
use super::table::{labelled, table, terminal, wrap};
use bench_base::progress::Progress;
use bench_config::Config;
use bench_excitation::Extremes;
use bench_experiment::linearity::{
    self, AmplitudePlan, ModeComparison, ModeOverAmplitude, compare_modes, plan_amplitudes,
};
use bench_experiment::outputs::{AnalysisOutputs, ExistingFile, ResultFiles};
use bench_experiment::{Run, RunSummary, Runner};
use bench_identify::modal::{Estimate, FittedMode};
use bench_order::{LinearityOrder, Order};
use bench_report::MagnitudeAxis;
use bench_report::figures::interval_of;
use bench_report::run_pages::AmplitudeFiles;

/// The order, and where its recordings go.
#[derive(Clone, Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    order: LinearityOrder,
    #[command(flatten)]
    pub run: RunOptions,
}

impl Args {
    /// The command with its order.
    pub(super) fn command(&self) -> RunCommand<'_> {
        RunCommand {
            order: Order::Linearity(self.order.clone()),
            options: &self.run,
            is_plan: false,
        }
    }
}

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    scales: Vec<f64>,
    /// One for each amplitude, as by `bench chirp`.
    runs: Vec<AmplitudeRun>,
    /// The modes of the smallest amplitude within the excited band, in all runs.
    modes: Vec<ModeOverAmplitude>,
    /// Whether a parameter of a mode differs from that at the smallest amplitude by more than its errors; null if unknown:
    /// without modes, or if no parameter differs but a run was not completed.
    shifted: Option<bool>,
    why: String,
    /// Picture and page of modes and distortion over the amplitude; null unless two runs were analysed.
    overview: Option<AmplitudeFiles>,
}

#[derive(Debug, Serialize)]
struct AmplitudeRun {
    scale: f64,
    expected: Extremes,
    #[serde(flatten)]
    run: RunSummary,
    #[serde(flatten)]
    outputs: AnalysisOutputs,
}

impl AmplitudeRun {
    fn exit(&self) -> Exit {
        analysis_exit(&self.run, &self.outputs)
    }
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let planned = args.order.planned()?;
    let plans = plan_amplitudes(&planned, &args.order.amplitude_ratios()?)?;
    if !args.order.bench.json {
        print_text(&plan_text(&plans))?;
    }
    let runs = measure(args, &plans)?;
    let outcome = overall(&runs);
    let band_hz = planned.chirp.band_hz();
    let mut report = report(runs, band_hz, outcome != Exit::Failed);
    report.overview = overview(&report, &plans)?;
    print_result(args.order.bench.json, &report, |report| {
        text(report, &plans)
    })?;
    Ok(outcome)
}

/// The excitation and its extremes at each amplitude, printed before the first run.
fn plan_text(plans: &[AmplitudePlan]) -> String {
    let excitation = plans.first().map(|plan| plan.config.excitation_text());
    let excitation = excitation.map_or(String::new(), |text| wrap(&text, 0));
    let amplitudes = plans.iter().map(|plan| {
        let line = expected_text(plan.scale, &plan.predicted);
        wrap(&line, 2)
    });
    excitation + &amplitudes.collect::<String>() + "\n"
}

fn expected_text(scale: f64, extremes: &Extremes) -> String {
    format!(
        "{scale} of the amplitude; expected travel {:.0} um, current {:.3} A",
        extremes.travel_m * 1e6,
        extremes.current_a
    )
}

/// Runs and analyses each amplitude, until a run fails.
fn measure(args: &Args, plans: &[AmplitudePlan]) -> Result<Vec<AmplitudeRun>, CliError> {
    let Some(first) = plans.first() else {
        return Ok(Vec::new());
    };
    let setup = args.command().setup(&first.config)?;
    let progress = Progress::new("linearity");
    let _line = ProgressLine::show(&progress);
    let runner = Runner::with_progress(setup, progress);
    let mut runs = Vec::new();
    linearity::run(&runner, plans, &mut |plan, run| {
        let finished = finish(plan, run, magnitude_axis(args.order.figures))?;
        let is_failed = finished.exit() == Exit::Failed;
        runs.push(finished);
        Ok::<bool, CliError>(!is_failed)
    })?;
    Ok(runs)
}

/// Analyses a run and adds the result to its recording.
fn finish(
    plan: &AmplitudePlan,
    mut run: Run,
    magnitude_axis: MagnitudeAxis,
) -> Result<AmplitudeRun, CliError> {
    let summary = RunSummary::of(&mut run)?;
    let outputs = outputs(&summary, &run.path, &plan.config, magnitude_axis)?;
    let finished = AmplitudeRun {
        scale: plan.scale,
        expected: plan.predicted,
        run: summary,
        outputs,
    };
    bench_experiment::close(run, &finished)?;
    Ok(finished)
}

/// A failure of any run, or else the first outcome that is not `Done`.
fn overall(runs: &[AmplitudeRun]) -> Exit {
    let mut outcomes = runs.iter().map(AmplitudeRun::exit);
    if outcomes.clone().any(|outcome| outcome == Exit::Failed) {
        return Exit::Failed;
    }
    let impaired = outcomes.find(|outcome| *outcome != Exit::Done);
    impaired.unwrap_or(Exit::Done)
}

fn report(runs: Vec<AmplitudeRun>, band_hz: (f64, f64), all_completed: bool) -> Report {
    let fitted: Vec<Vec<FittedMode>> = runs
        .iter()
        .map(|run| run.outputs.summary.modes.clone())
        .collect();
    let ModeComparison {
        modes,
        shifted,
        why,
    } = compare_modes(&fitted, band_hz, all_completed);
    Report {
        scales: runs.iter().map(|run| run.scale).collect(),
        runs,
        modes,
        shifted,
        why,
        overview: None,
    }
}

/// Draws the modes and the distortion over the amplitude, beside the recording of the first run.
fn overview(report: &Report, plans: &[AmplitudePlan]) -> Result<Option<AmplitudeFiles>, CliError> {
    let (Some(first), Some(plan)) = (report.runs.first(), plans.first()) else {
        return Ok(None);
    };
    let runs = report.runs.iter().map(|run| (run.scale, &run.outputs));
    let runs: Vec<(f64, &AnalysisOutputs)> = runs.collect();
    let results = ResultFiles {
        beside: Path::new(&first.run.recording),
        existing: ExistingFile::Replace,
    };
    let files = AmplitudeFiles::write(&runs, &report.modes, &plan.config, results)?;
    Ok(files)
}

fn text(report: &Report, plans: &[AmplitudePlan]) -> String {
    let runs = report.runs.iter().zip(plans);
    let runs: String = runs
        .map(|(run, plan)| amplitude_text(run, &plan.config))
        .collect();
    let overview = report.overview.as_ref();
    let overview = overview.map_or(String::new(), |files| labelled("overview", &files.report));
    format!(
        "{runs}{}\n{}{overview}",
        mode_table(&report.scales, &report.modes),
        wrap(
            &format!("modes over amplitude (* shifts): {}", report.why),
            0
        )
    )
}

fn amplitude_text(run: &AmplitudeRun, config: &Config) -> String {
    let page = run.outputs.pages.report.as_ref();
    let page = page.map_or(String::new(), |path| labelled("report", path));
    let linearity = match &run.outputs.linearity {
        Some(linearity) => linearity_output::text(linearity),
        None => analysis_output::text(&run.outputs),
    };
    format!(
        "{}\n{}{page}{linearity}\n",
        expected_text(run.scale, &run.expected),
        run_text(&run.run, config)
    )
}

/// One row for each mode and amplitude, with 95 % intervals.
fn mode_table(scales: &[f64], modes: &[ModeOverAmplitude]) -> String {
    let rows = modes.iter().flat_map(|mode| {
        let runs = scales.iter().zip(&mode.by_run);
        runs.map(move |(scale, fitted)| mode_row(*scale, mode, fitted.as_ref()))
    });
    let rows: Vec<Vec<String>> = rows.collect();
    table(&["amplitude", "mode Hz", "damping", "residue 1/kg"], &rows)
}

fn mode_row(scale: f64, mode: &ModeOverAmplitude, fitted: Option<&FittedMode>) -> Vec<String> {
    let Some(fitted) = fitted else {
        return vec![
            scale.to_string(),
            "not found".into(),
            String::new(),
            String::new(),
        ];
    };
    vec![
        scale.to_string(),
        cell(fitted.frequency_hz(), mode.frequency_shifts),
        cell(fitted.damping_ratio, mode.damping_shifts),
        cell(fitted.residue_per_kg, mode.residue_shifts),
    ]
}

fn cell(estimate: Estimate, shifts: bool) -> String {
    let text = terminal(&interval_of(estimate));
    if shifts { text + " *" } else { text }
}
