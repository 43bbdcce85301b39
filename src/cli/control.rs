//! `bench control`: run the closed loop with a reference.

use super::analysis_output::analysis_exit;
use super::chirp::outputs;
use super::control_output::{self, ControlResult, PlanText, Report};
use super::error::CliError;
use super::exit::Exit;
use super::output::{print_result, print_text, warn};
use super::plan_output;
use super::run_options::{RunCommand, RunOptions, close, exit};
use bench_config::warnings;
use bench_control::listed_poles;
use bench_experiment::evidence::{Evidence, require_evidence};
use bench_experiment::{
    ControlForecast, Plan, PredictedLoop, Run, RunSummary, closed_loop, require_margins,
};
use bench_order::{ControlOrder, Order, defaults_help};
use bench_report::MagnitudeAxis;

/// The order, and where its recording goes.
#[derive(Clone, Debug, clap::Args)]
#[command(after_help = defaults_help())]
pub(super) struct Args {
    #[command(flatten)]
    order: ControlOrder,
    #[command(flatten)]
    pub run: RunOptions,
    /// Only print what the run would do: margins, travel, current, heat, duration; no motion
    #[arg(long)]
    plan: bool,
}

impl Args {
    /// The command with its order.
    pub(super) fn command(&self) -> RunCommand<'_> {
        RunCommand {
            order: Order::Control(Box::new(self.order.clone())),
            options: &self.run,
            is_plan: self.plan,
        }
    }
}

pub(super) fn run(args: &Args) -> Result<Exit, CliError> {
    let config = args.order.config()?;
    let closed_loop = closed_loop(&config)?;
    let margins = closed_loop.margins();
    let stage = args.order.rig.stage(&config);
    require_margins(&config, &margins, stage)?;
    let plan = Plan::control(config.clone())?.with_override(args.order.override_reason.clone());
    let evidence = require_evidence(&plan, stage, None)?;
    let predicted = PredictedLoop::new(&plan, &closed_loop, margins);
    if args.plan {
        return print_plan(args, &plan, predicted, evidence);
    }
    if !args.order.bench.json {
        let poles = listed_poles(&closed_loop.poles(), config.servo.rate_hz);
        let text = PlanText {
            plan: &plan,
            predicted: &predicted,
            poles: &poles,
            evidence: &evidence,
        };
        print_text(&text.to_string())?;
    }
    let mut run = args.command().run(&plan, "control")?;
    let report = report(&mut run, &plan, predicted, evidence, args.order.no_report)?;
    let text = control_output::text(&report, &config);
    close(run, &report, args.order.bench.json, &text)?;
    Ok(match &report.made {
        Some(made) => analysis_exit(&report.run, made),
        None => exit(&report.run),
    })
}

/// Prints what the run would do.
fn print_plan(
    args: &Args,
    plan: &Plan,
    predicted: PredictedLoop,
    evidence: Evidence,
) -> Result<Exit, CliError> {
    let mut forecast = ControlForecast::new(plan, predicted, evidence)?;
    forecast.motor = args.order.rig.motor_summary(plan)?;
    warn(&warnings(&plan.config));
    warn(&forecast.evidence.defects);
    print_result(args.order.bench.json, &forecast, |forecast| {
        plan_output::control_text(forecast)
            + &control_output::evidence_text(&forecast.evidence)
            + &control_output::conditions_table(&forecast.evidence.conditions)
    })?;
    Ok(Exit::Done)
}

/// The result of a run: tracking, or responses of a swept reference.
fn report(
    run: &mut Run,
    plan: &Plan,
    predicted: PredictedLoop,
    evidence: Evidence,
    no_report: bool,
) -> Result<Report, CliError> {
    let summary = RunSummary::of(run)?;
    let is_completed = summary.is_completed();
    let mut result = ControlResult::default();
    let mut made = None;
    if plan.config.control.reference.is_swept() {
        let mut outputs = outputs(&summary, &run.path, &plan.config, MagnitudeAxis::default())?;
        if !is_completed {
            let files = control_output::result(&run.path, is_completed, no_report)?.files;
            outputs.pages.extend(files);
        }
        made = Some(outputs);
    } else {
        result = control_output::result(&run.path, is_completed, no_report)?;
    }
    Ok(Report {
        run: summary,
        predicted,
        command: plan.command_summary().cloned(),
        result,
        expected: plan.predicted_extremes,
        evidence,
        made,
    })
}
