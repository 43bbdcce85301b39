//! `bench control`: run the closed loop with a reference.

use std::path::Path;

use serde::Serialize;

use super::analysis_output;
use super::chirp::{outcome, outputs};
pub(super) use super::control_options::Args;
use super::error::CliError;
use super::margins::text as margins_text;
use super::outcome::Outcome;
use super::output::print_text;
use super::run_options::{close, exit, run_text};
use super::table::labelled;
use crate::config::{Config, Purpose};
use crate::control::{ClosedLoop, Margins, Pole, StepMetrics, listed_poles, step_metrics};
use crate::excitation::Extremes;
use crate::experiment::{
    Plan, Run, RunSummary, TrackingMetrics, closed_loop, require_margins, tracking_metrics,
};
use crate::recording::Recording;
use crate::report::run_pages::AnalysisOutputs;
use crate::util::decimal::Decimal;

/// Largest number of ticks of a predicted step: 200 s at 5 kHz.
const PREDICTED_TICKS: usize = 1_000_000;

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    run: RunSummary,
    predicted: Predicted,
    measured: Option<TrackingMetrics>,
    /// Extremes of a swept reference by the model.
    expected: Option<Extremes>,
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
    require_margins(&config, &margins, args.run.stage(&config))?;
    let predicted = predicted(margins, &config, &closed_loop);
    let plan = Plan::control(config.clone())?;
    if !args.bench.json {
        let poles = listed_poles(&closed_loop.poles(), config.servo.rate_hz);
        print_text(&plan_text(&plan, &predicted, &poles))?;
    }
    let mut run = args.run.run(&plan, "control")?;
    let report = report(&mut run, &plan, predicted)?;
    close(run, &report, args.bench.json, &text(&report, &config))?;
    Ok(match &report.made {
        Some(made) => outcome(&report.run, made),
        None => exit(&report.run),
    })
}

/// The margins and the step by the model.
fn predicted(margins: Margins, config: &Config, closed_loop: &ClosedLoop) -> Predicted {
    let step = match margins.stable {
        true => predicted_step(config, closed_loop),
        false => None,
    };
    Predicted { margins, step }
}

/// The result of a run: tracking, or responses of a swept reference.
fn report(run: &mut Run, plan: &Plan, predicted: Predicted) -> Result<Report, CliError> {
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

/// The step by the linear model, if the reference is a step within the run.
fn predicted_step(config: &Config, closed_loop: &ClosedLoop) -> Option<StepMetrics> {
    let step = config.control.reference.design().step()?;
    let (amplitude_m, at_s) = (step.height_m, step.at_s);
    let after_s = config.control.duration_s - at_s;
    let ticks = ((after_s * config.servo.rate_hz) as usize).min(PREDICTED_TICKS);
    let positions = closed_loop.simulate(ticks, |_| amplitude_m);
    (amplitude_m != 0.0 && ticks > 0)
        .then(|| step_metrics(&positions, amplitude_m, config.servo.period_s()))
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
