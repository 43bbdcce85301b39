//! `bench control`: run the closed loop with a reference.

use serde::Serialize;

use super::analysis_output::analysis_exit;
use super::chirp::outputs;
use super::control_output::{self, ControlResult, PlanText, Predicted, Report};
use super::error::CliError;
use super::exit::Exit;
use super::output::{print_result, print_text, warn};
use super::plan_output;
use super::run_options::{RunCommand, RunOptions, close, exit};
use bench_config::warnings;
use bench_control::{ClosedLoop, Margins, listed_poles};
use bench_excitation::Extremes;
use bench_experiment::evidence::{Evidence, require_evidence};
use bench_experiment::{
    CommandSummary, MotorSummary, Plan, PlanLimits, PredictedSine, Run, RunSummary, closed_loop,
    predicted_step, require_margins,
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
    let predicted = predicted(margins, &plan, &closed_loop);
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

/// The JSON object of `--plan`.
#[derive(Debug, Serialize)]
struct PlanReport {
    reference: String,
    /// Extremes by the model; `None` if the loop of the model is unstable.
    expected: Option<Extremes>,
    limits: PlanLimits,
    motor: Option<MotorSummary>,
    /// Range and mounting of the probe; `None` for the simulated probe.
    #[serde(skip_serializing_if = "Option::is_none")]
    probe: Option<String>,
    predicted: Predicted,
    /// Shaping, prefilter and feedforward.
    #[serde(skip_serializing_if = "Option::is_none")]
    command: Option<CommandSummary>,
    evidence: Evidence,
}

/// Prints what the run would do.
fn print_plan(
    args: &Args,
    plan: &Plan,
    predicted: Predicted,
    evidence: Evidence,
) -> Result<Exit, CliError> {
    let config = &plan.config;
    let report = PlanReport {
        reference: control_output::reference_text(config),
        expected: plan.loop_extremes()?,
        limits: PlanLimits::of(config),
        motor: args.order.rig.motor_summary(plan)?,
        probe: config.probe.device.scale_text(),
        predicted,
        command: plan.command_summary().cloned(),
        evidence,
    };
    warn(&warnings(config));
    warn(&report.evidence.defects);
    print_result(args.order.bench.json, &report, |report| {
        let command = report.command.as_ref().map(control_output::command_text);
        let text = plan_output::control_text(
            &(report.reference.clone() + &command.unwrap_or_default()),
            report.expected.as_ref(),
            &report.limits,
            report.motor.as_ref(),
        );
        text + &plan_output::probe_text(report.probe.as_deref())
            + &control_output::evidence_text(&report.evidence)
            + &control_output::conditions_table(&report.evidence.conditions)
    })?;
    Ok(Exit::Done)
}

/// The margins and the response to the reference by the model.
fn predicted(margins: Margins, plan: &Plan, closed_loop: &ClosedLoop) -> Predicted {
    let step = if margins.stable {
        predicted_step(plan, closed_loop).map(|step| step.metrics)
    } else {
        None
    };
    Predicted {
        sine: PredictedSine::of(&plan.config, closed_loop, &margins),
        margins,
        step,
    }
}

/// The result of a run: tracking, or responses of a swept reference.
fn report(
    run: &mut Run,
    plan: &Plan,
    predicted: Predicted,
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
