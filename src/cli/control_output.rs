//! Plan and result of `bench control`: the analysis of the recording, and its text.

use std::fmt;
use std::path::Path;

use serde::Serialize;

use super::analysis_output;
use super::analysis_output::analysis_failed;
use super::error::CliError;
use super::margins::text as margins_text;
use super::output::warn;
use super::run_options::run_text;
use super::table::{figure_sentence, labelled, table};
use bench_base::decimal::Decimal;
use bench_config::Config;
use bench_control::Pole;
use bench_excitation::Extremes;
use bench_experiment::evidence::{Agreement, Condition, Evidence};
use bench_experiment::outputs::{AnalysisOutputs, ControlFiles, ExistingFile, ResultFiles};
use bench_experiment::stage_check::RestAfterCheck;
use bench_experiment::{
    CommandSummary, Plan, PredictedLoop, RunFigures, RunSummary, TrackingMetrics,
    abandon_on_signal, control_run, run_figures, tracking_metrics,
};
use bench_recording::Recording;
use bench_report::figures::{self, Figure};
use bench_report::run_pages::{ControlReport, write_control_page};

/// The JSON object of the command.
#[derive(Debug, Serialize)]
pub(super) struct Report {
    #[serde(flatten)]
    pub run: RunSummary,
    pub predicted: PredictedLoop,
    /// Shaping, prefilter and feedforward.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub command: Option<CommandSummary>,
    /// Tracking, plots and page; of a swept reference `None`.
    #[serde(flatten)]
    pub result: ControlResult,
    /// Extremes of a swept reference by the model.
    pub expected: Option<Extremes>,
    /// The certificate with which the loop closed, and what is wrong with it.
    pub evidence: Evidence,
    /// Responses of plant and loop, from a swept reference.
    #[serde(flatten)]
    pub made: Option<AnalysisOutputs>,
}

/// What a recorded run shows, unless its reference is swept.
#[derive(Debug, Default, Serialize)]
pub(super) struct ControlResult {
    /// Settling, overshoot and steady state; `None` if the run ended before it.
    pub measured: Option<TrackingMetrics>,
    /// Largest values and heat, also of a run that tripped.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub whole_run: Option<RunFigures>,
    /// Tracking and largest values as shown.
    pub figures: Vec<Figure>,
    /// Plots and page; `None` with `--no-report`.
    #[serde(flatten)]
    pub files: Option<ControlFiles>,
}

/// Analyses a recorded run and writes its report. Ctrl-C cancels it; the recording stays complete.
pub(super) fn result(
    path: &Path,
    is_completed: bool,
    no_report: bool,
) -> Result<ControlResult, CliError> {
    let recording = path.to_path_buf();
    let work = move || {
        if no_report {
            figures_only(&recording)
        } else {
            analysed(&recording)
        }
    };
    let result = abandon_on_signal(work).map_err(|error| CliError::Failed(error.to_string()))?;
    let result = result.unwrap_or_else(|| Ok(ControlResult::default()));
    let result = result.map_err(|error| analysis_failed(&error, path))?;
    let measured = result.measured.filter(|_| is_completed);
    let tracking = measured.iter().flat_map(figures::tracking_figures);
    let whole_run = result.whole_run.iter().flat_map(figures::whole_run);
    Ok(ControlResult {
        figures: tracking.chain(whole_run).collect(),
        measured,
        ..result
    })
}

fn figures_only(path: &Path) -> Result<ControlResult, CliError> {
    let recording = Recording::open(path)?;
    let plan = Plan::of(&recording)?;
    let config = &plan.config;
    Ok(ControlResult {
        measured: tracking_metrics(&recording, &config.control, &config.servo)?,
        whole_run: Some(run_figures(&recording, config, plan.motor.thermal_a2)?),
        ..ControlResult::default()
    })
}

fn analysed(path: &Path) -> Result<ControlResult, CliError> {
    let recording = Recording::open(path)?;
    let plan = Plan::of(&recording)?;
    let run = control_run(&recording, &plan)?;
    let report = ControlReport {
        recording: &recording,
        config: &plan.config,
        run: &run,
    };
    let results = ResultFiles {
        beside: path,
        existing: ExistingFile::Replace,
    };
    Ok(ControlResult {
        measured: run.tracking,
        whole_run: Some(run.figures),
        files: written(&report, results),
        ..ControlResult::default()
    })
}

/// Writes plots and page. If this fails, for example on a full disk, the results of the run are still stored and printed.
fn written(report: &ControlReport<'_>, results: ResultFiles<'_>) -> Option<ControlFiles> {
    let files = write_control_page(report, results);
    files
        .inspect_err(|error| warn(&[format!("no report: {error}")]))
        .ok()
}

/// Margins, reference and predicted response, printed before the run.
pub(super) struct PlanText<'a> {
    pub plan: &'a Plan,
    pub predicted: &'a PredictedLoop,
    pub poles: &'a [Pole],
    pub evidence: &'a Evidence,
}

impl fmt::Display for PlanText<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let config = &self.plan.config;
        let margins = margins_text(config, &self.predicted.margins, self.poles);
        f.write_str(&margins)?;
        f.write_str(&labelled("reference", &config.reference_text()))?;
        if let Some(command) = self.plan.command_summary() {
            let text = command_text(command);
            f.write_str(&labelled("command", text.trim_start_matches("; ")))?;
        }
        if let Some(step) = &self.predicted.step {
            f.write_str(&labelled(
                "predicted",
                &figure_sentence(&figures::step(step)),
            ))?;
        }
        if let Some(sine) = &self.predicted.sine {
            f.write_str(&labelled(
                "predicted",
                &figure_sentence(&figures::predicted_sine(sine)),
            ))?;
        }
        if let Some(extremes) = &self.plan.predicted_extremes {
            f.write_str(&travel_text(extremes))?;
        }
        f.write_str(&evidence_text(self.evidence))
    }
}

/// The certificate and the margin that it proves, and an override.
pub(super) fn evidence_text(evidence: &Evidence) -> String {
    let certificate = evidence.certificate.as_ref().map_or(String::new(), |file| {
        let margin = evidence
            .modulus_margin_lower
            .map_or("no modulus margin by its response".into(), |margin| {
                format!("modulus margin at least {margin:.3} by its response (95 %)")
            });
        let conditions = conditions_text(&evidence.conditions);
        labelled("evidence", &format!("{file}: {margin}; {conditions}"))
    });
    let rest = evidence.rest_after_check.as_ref();
    let certificate = certificate + &rest.map_or(String::new(), rest_text);
    let reason = evidence.override_reason.as_ref();
    certificate + &reason.map_or(String::new(), |reason| labelled("override", reason))
}

/// How many of the compared conditions agree.
fn conditions_text(conditions: &[Condition]) -> String {
    let count = |agreement: Agreement| {
        let found = conditions.iter();
        found.filter(|found| found.agreement == agreement).count()
    };
    let (agree, differ) = (count(Agreement::Agrees), count(Agreement::Differs));
    format!("{agree} of {} conditions agree", agree + differ)
}

/// The conditions of a certificate as a table.
pub(super) fn conditions_table(conditions: &[Condition]) -> String {
    let rows: Vec<Vec<String>> = conditions.iter().map(condition_row).collect();
    if rows.is_empty() {
        String::new()
    } else {
        table(&["condition", "certificate", "today", "result"], &rows)
    }
}

fn condition_row(condition: &Condition) -> Vec<String> {
    vec![
        condition.subject.name().into(),
        condition.certificate.clone(),
        condition.today.clone(),
        condition.agreement.name().into(),
    ]
}

/// The rest between the check of the stage and the closing of the loop.
fn rest_text(rest: &RestAfterCheck) -> String {
    let (left_um, permitted_um) = (rest.left_m * 1e6, rest.permitted_m * 1e6);
    let limited = if rest.is_limited {
        format!(", above the permitted {permitted_um:.2} um because the rest is limited")
    } else {
        String::new()
    };
    let text = format!(
        "{:.2} s with zero current after the check of the stage; at most {left_um:.2} um of its vibration are left{limited}",
        rest.rest_s
    );
    labelled("rest", &text)
}

fn travel_text(extremes: &Extremes) -> String {
    let travel_um = extremes.travel_m * 1e6;
    labelled(
        "expected",
        &format!("travel of {travel_um:.1} um by the model"),
    )
}

/// Shaping, prefilter and feedforward, each after a semicolon.
pub(super) fn command_text(command: &CommandSummary) -> String {
    let mut parts = vec![shaper_text(command)];
    if command.prefilter {
        parts.push("low-pass".into());
    }
    if command.feedforward {
        let preview_ms = Decimal(command.preview_s * 1e3);
        parts.push(format!("feedforward with a preview of {preview_ms:.1} ms"));
    }
    let parts = parts.iter().filter(|part| !part.is_empty());
    parts.map(|part| format!("; {part}")).collect()
}

fn shaper_text(command: &CommandSummary) -> String {
    let kind = command.shaper;
    match (command.settling_time_s, command.plants) {
        (Some(settling_s), Some(plants)) => format!(
            "minimum time: {:.1} ms to 2 % for {plants} plants, at most {:.2} A, overshoot {:.1} %",
            settling_s * 1e3,
            command.current_a.unwrap_or_default(),
            Decimal(command.overshoot_percent.unwrap_or_default()),
        ),
        _ if command.modes.is_empty() => String::new(),
        _ => {
            let modes = command.modes.iter();
            let modes: Vec<String> = modes
                .map(|mode| format!("{:.1} rad/s", mode.omega_rad_s))
                .collect();
            let (modes, delay_ms) = (modes.join(", "), command.delay_s * 1e3);
            format!("{kind} shaper for {modes}, delay {delay_ms:.1} ms")
        }
    }
}

/// The result of the run.
pub(super) fn text(report: &Report, config: &Config) -> String {
    let run = run_text(&report.run, config);
    match &report.made {
        Some(made) => run + &analysis_output::text(made) + &page_text(incomplete_page(report)),
        None => result_text(&report.result, &run),
    }
}

/// The page of a swept run that did not come to its end; that of an analysed run is listed with its plots.
fn incomplete_page(report: &Report) -> Option<&String> {
    let made = report.made.as_ref().filter(|_| !report.run.is_completed());
    made.and_then(|made| made.pages.report.as_ref())
}

fn page_text(page: Option<&String>) -> String {
    page.map_or(String::new(), |page| labelled("report", page))
}

fn result_text(result: &ControlResult, run: &str) -> String {
    let measured = measured_text(result.measured.as_ref());
    let figures = result.whole_run.as_ref().map(figures_text);
    let page = result
        .files
        .as_ref()
        .and_then(|files| files.report.as_ref());
    measured + &figures.unwrap_or_default() + run + &page_text(page)
}

fn measured_text(measured: Option<&TrackingMetrics>) -> String {
    let Some(measured) = measured else {
        return labelled(
            "measured",
            "no result: the run ended before the steady state",
        );
    };
    labelled(
        "measured",
        &figure_sentence(&figures::tracking_figures(measured)),
    )
}

fn figures_text(run: &RunFigures) -> String {
    labelled("whole run", &figure_sentence(&figures::whole_run(run)))
}
