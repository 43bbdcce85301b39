//! `bench control`: close the loop with a reference.

use serde::Serialize;

use super::analysis_output;
use super::chirp::analysed;
pub(super) use super::control_options::Args;
use super::error::CliError;
use super::margins::{Pole, closed_loop, pole_list, require_modulus_margin, text as margins_text};
use super::outcome::Outcome;
use super::output::print_text;
use super::run_options::{close, exit, run_text};
use super::table::labelled;
use crate::config::{Config, Purpose};
use crate::control::{ClosedLoop, Margins, StepMetrics, step_metrics};
use crate::excitation::Extremes;
use crate::experiment::{Plan, RunSummary, TrackingMetrics, tracking_metrics};
use crate::recording::Recording;
use crate::report::run_pages::AnalysisOutputs;

/// A step is predicted over as many ticks at most: 200 s at 5 kHz, however long the run.
const PREDICTED_TICKS: usize = 1_000_000;

/// The JSON object of the command.
#[derive(Debug, Serialize)]
struct Report {
    #[serde(flatten)]
    run: RunSummary,
    predicted: Predicted,
    measured: Option<TrackingMetrics>,
    /// What a swept reference does by the model.
    expected: Option<Extremes>,
    /// What a swept reference shows of plant and loop.
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
    require_modulus_margin(&config, &margins)?;
    let step = if margins.stable {
        predicted_step(&config, &closed_loop)
    } else {
        None
    };
    let predicted = Predicted { margins, step };
    let plan = Plan::control(config.clone())?;
    let expected = plan.predicted_extremes;
    if !args.bench.json {
        let poles = pole_list(&closed_loop.poles(), &config);
        print_text(&plan_text(&config, &predicted, &poles, expected.as_ref()))?;
    }
    let mut run = args.run.run(&plan, "control")?;
    let report = RunSummary::of(&mut run)?;
    let completed = report.is_completed();
    let swept = config.control.reference.is_swept();
    let measured = match completed && !swept {
        true => tracking_metrics(&Recording::open(&run.path)?, &config.control, &config.servo)?,
        false => None,
    };
    let made = match (swept, completed) {
        (true, true) => Some(analysed(&run.path, &plan.config)?),
        (true, false) => Some(AnalysisOutputs::run_incomplete()),
        (false, _) => None,
    };
    let report = Report {
        run: report,
        predicted,
        measured,
        expected,
        made,
    };
    close(run, &report, args.bench.json, &text(&report, &config))?;
    let stopped = report
        .made
        .as_ref()
        .is_some_and(AnalysisOutputs::is_cancelled);
    Ok(if stopped {
        Outcome::Failed
    } else {
        exit(&report.run)
    })
}

/// The step by the linear model, if the reference is one that happens.
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
fn plan_text(
    config: &Config,
    predicted: &Predicted,
    poles: &[Pole],
    expected: Option<&Extremes>,
) -> String {
    let margins = margins_text(config, &predicted.margins, poles);
    let reference = labelled("reference", &reference_text(config));
    let step = predicted.step.as_ref().map_or(String::new(), |step| {
        labelled("predicted", &step_text(step))
    });
    let travel = expected.map_or(String::new(), |expected| {
        let travel_um = expected.travel_m * 1e6;
        labelled(
            "expected",
            &format!("travel of {travel_um:.1} um by the model"),
        )
    });
    margins + &reference + &step + &travel
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
    let overshoot = step.overshoot_percent;
    format!("settling to 2 % in {settling}, overshoot {overshoot:.1} %")
}

/// How the run went and what it shows.
fn text(report: &Report, config: &Config) -> String {
    let run = run_text(&report.run, config);
    match &report.made {
        Some(made) => run + &analysis_output::text(made),
        None => measured_text(report.measured.as_ref()) + &run,
    }
}

fn measured_text(measured: Option<&TrackingMetrics>) -> String {
    let Some(measured) = measured else {
        return labelled("measured", "nothing: the run did not reach a steady state");
    };
    let step = measured.step.as_ref().map(step_text);
    let steady = format!(
        "steady state: mean error {:+.4} um, sigma {:.4} um",
        measured.steady_state_mean_error_m * 1e6,
        measured.steady_state_sigma_m * 1e6
    );
    let parts: Vec<String> = step.into_iter().chain([steady]).collect();
    labelled("measured", &parts.join("; "))
}
