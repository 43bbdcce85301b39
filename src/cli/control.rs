//! `bench control`: run the closed loop with a reference.

use std::path::Path;

use serde::Serialize;

use super::analysis_output;
use super::chirp::{outcome, outputs};
pub(super) use super::control_options::Args;
use super::error::CliError;
use super::margins::text as margins_text;
use super::outcome::Outcome;
use super::output::{print_result, print_text, warn};
use super::plan_output;
use super::run_options::{close, exit, run_text};
use super::table::labelled;
use crate::config::{Config, Purpose};
use crate::control::{ClosedLoop, Margins, Pole, StepMetrics, listed_poles};
use crate::excitation::Extremes;
use crate::experiment::certificate::{Evidence, require_evidence};
use crate::experiment::{
    MotorSummary, Plan, PlanLimits, Run, RunSummary, TrackingMetrics, closed_loop, predicted_step,
    require_margins, tracking_metrics,
};
use crate::recording::Recording;
use crate::report::run_pages::AnalysisOutputs;
use crate::util::decimal::Decimal;

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    run: RunSummary,
    predicted: Predicted,
    measured: Option<TrackingMetrics>,
    /// Extremes of a swept reference by the model.
    expected: Option<Extremes>,
    /// The certificate with which the loop closed, and what is wrong with it.
    evidence: Evidence,
    /// Responses of plant and loop, from a swept reference.
    #[serde(flatten)]
    made: Option<AnalysisOutputs>,
}

#[derive(Debug, Serialize)]
struct Predicted {
    #[serde(flatten)]
    margins: Margins,
    #[serde(flatten)]
    step: Option<StepMetrics>,
}

pub(super) fn run(args: &Args) -> Result<Outcome, CliError> {
    let config = args.bench.load(Purpose::Control, &args.settings()?)?;
    let closed_loop = closed_loop(&config)?;
    let margins = closed_loop.margins();
    let stage = args.run.stage(&config);
    require_margins(&config, &margins, stage)?;
    let predicted = predicted(margins, &config, &closed_loop);
    let plan = Plan::control(config.clone())?.with_override(args.override_reason.clone());
    let evidence = require_evidence(&plan, stage, None)?;
    if args.plan {
        return print_plan(args, &plan, predicted, evidence);
    }
    if !args.bench.json {
        let poles = listed_poles(&closed_loop.poles(), config.servo.rate_hz);
        print_text(&(plan_text(&plan, &predicted, &poles) + &evidence_text(&evidence)))?;
    }
    let mut run = args.run.run(&plan, "control")?;
    let report = report(&mut run, &plan, predicted, evidence)?;
    close(run, &report, args.bench.json, &text(&report, &config))?;
    Ok(match &report.made {
        Some(made) => outcome(&report.run, made),
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
    predicted: Predicted,
    evidence: Evidence,
}

/// Prints what the run would do.
fn print_plan(
    args: &Args,
    plan: &Plan,
    predicted: Predicted,
    evidence: Evidence,
) -> Result<Outcome, CliError> {
    let config = &plan.config;
    let report = PlanReport {
        reference: reference_text(config),
        expected: plan.loop_extremes()?,
        limits: PlanLimits::of(config),
        motor: args.run.motor_summary(plan)?,
        predicted,
        evidence,
    };
    warn(&report.evidence.defects);
    print_result(args.bench.json, &report, |report| {
        plan_output::control_text(
            &report.reference,
            report.expected.as_ref(),
            &report.limits,
            report.motor.as_ref(),
        ) + &evidence_text(&report.evidence)
    })?;
    Ok(Outcome::Done)
}

/// The margins and the step by the model.
fn predicted(margins: Margins, config: &Config, closed_loop: &ClosedLoop) -> Predicted {
    let step = match margins.stable {
        true => predicted_step(config, closed_loop).map(|step| step.metrics),
        false => None,
    };
    Predicted { margins, step }
}

/// The result of a run: tracking, or responses of a swept reference.
fn report(
    run: &mut Run,
    plan: &Plan,
    predicted: Predicted,
    evidence: Evidence,
) -> Result<Report, CliError> {
    let summary = RunSummary::of(run)?;
    let is_swept = plan.config.control.reference.is_swept();
    let measured = match summary.is_completed() && !is_swept {
        true => tracking(&run.path, &plan.config)?,
        false => None,
    };
    let made = match is_swept {
        true => Some(outputs(&summary, &run.path, &plan.config)?),
        false => None,
    };
    Ok(Report {
        run: summary,
        predicted,
        measured,
        expected: plan.predicted_extremes,
        evidence,
        made,
    })
}

/// The measured tracking of a recorded run.
fn tracking(path: &Path, config: &Config) -> Result<Option<TrackingMetrics>, CliError> {
    let recording = Recording::open(path)?;
    Ok(tracking_metrics(
        &recording,
        &config.control,
        &config.servo,
    )?)
}

/// Margins, reference and predicted step, printed before the run.
fn plan_text(plan: &Plan, predicted: &Predicted, poles: &[Pole]) -> String {
    let margins = margins_text(&plan.config, &predicted.margins, poles);
    let reference = labelled("reference", &reference_text(&plan.config));
    let step = predicted.step.as_ref().map_or(String::new(), |step| {
        labelled("predicted", &step_text(step))
    });
    let travel = plan
        .predicted_extremes
        .as_ref()
        .map_or(String::new(), travel_text);
    margins + &reference + &step + &travel
}

/// The certificate and the margin that it proves, and an override.
fn evidence_text(evidence: &Evidence) -> String {
    let certificate = evidence.certificate.as_ref().map_or(String::new(), |file| {
        let margin = evidence
            .modulus_margin_lower
            .map_or("no modulus margin by its response".into(), |margin| {
                format!("modulus margin at least {margin:.3} by its response (95 %)")
            });
        labelled("evidence", &format!("{file}: {margin}"))
    });
    let reason = evidence.override_reason.as_ref();
    certificate + &reason.map_or(String::new(), |reason| labelled("override", reason))
}

fn travel_text(extremes: &Extremes) -> String {
    let travel_um = extremes.travel_m * 1e6;
    labelled(
        "expected",
        &format!("travel of {travel_um:.1} um by the model"),
    )
}

/// The reference, and how long the loop is closed.
fn reference_text(config: &Config) -> String {
    let duration_s = config.control.duration_s;
    let reference = &config.control.reference;
    if reference.is_swept() {
        return config.swept_reference_text();
    }
    let reference = reference.design().describe();
    format!("{reference}; the loop is closed for {duration_s} s")
}

fn step_text(step: &StepMetrics) -> String {
    let settling = step
        .settling_time_s
        .map_or("none".into(), |s| format!("{:.1} ms", s * 1e3));
    let overshoot = Decimal(step.overshoot_percent);
    format!("settling to 2 % in {settling}, overshoot {overshoot:.1} %")
}

/// The result of the run.
fn text(report: &Report, config: &Config) -> String {
    let run = run_text(&report.run, config);
    match &report.made {
        Some(made) => run + &analysis_output::text(made),
        None => measured_text(report.measured.as_ref()) + &run,
    }
}

fn measured_text(measured: Option<&TrackingMetrics>) -> String {
    let Some(measured) = measured else {
        return labelled(
            "measured",
            "no result: the run ended before the steady state",
        );
    };
    let step = measured.step.as_ref().map(step_text);
    let steady = format!(
        "steady state: mean error {:+.4} um, sigma {:.4} um",
        Decimal(measured.steady_state_mean_error_m * 1e6),
        measured.steady_state_sigma_m * 1e6
    );
    let parts: Vec<String> = step.into_iter().chain([steady]).collect();
    labelled("measured", &parts.join("; "))
}
