//! One page for several recordings: their differences, their frequency responses and their steps.

use super::run_differences::differences;
use crate::figures::step_table;
use crate::html::{document_with_plots, escaped, note, picture, section};
use crate::{
    ReportError, SignalsPlot, StepCurve, StepPlot, overlay_bode_svg, overlay_steps_svg,
    signals_svg, step_svg,
};
use bench_experiment::run_comparison::{Comparison, RunResult};
use bench_experiment::{Extent, Overview, StepResponse};
use bench_identify::{Frf, Unit};

/// Most recordings on one page: their curves have 4 colours and 3 strokes, so those of more cannot be distinguished.
pub const MAX_COMPARED: usize = 12;
/// Longest part of a step that is drawn, as a multiple of its settling time.
const SETTLING_TIMES: f64 = 4.0;
/// Shortest and longest part in seconds.
const DRAWN_S: (f64, f64) = (0.05, 20.0);

const STEP_CAPTION: &str =
    "Position from the rest position since the step. The band is 2 % of the step.";
const SIGNALS_CAPTION: &str =
    "The whole run. Each column reaches from minimum to maximum, so that no spike is left out.";
const FRF_CAPTION: &str = "Measured responses, each with a band of two sigma.";

/// The page of recordings as an HTML document, with the tables of their differences if they were compared.
///
/// # Errors
/// When there is nothing to draw.
pub fn comparison_page(
    runs: &[RunResult],
    comparison: Option<&Comparison>,
) -> Result<String, ReportError> {
    let plots = [responses(runs)?, steps(runs)?].concat();
    let parts = comparison.map_or_else(String::new, differences) + &plots;
    if parts.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let title = format!("Comparison of {} recordings", runs.len());
    let heading = format!("<h1>{}</h1>\n", escaped(&title));
    Ok(document_with_plots(&title, &(heading + &parts)))
}

/// Measured frequency responses in one plot.
fn responses(runs: &[RunResult]) -> Result<String, ReportError> {
    let measured = runs
        .iter()
        .filter_map(|run| Some((run.label.as_str(), &run.analysis.as_ref()?.frf)));
    let measured: Vec<(&str, &Frf)> = measured.collect();
    if measured.is_empty() {
        return Ok(String::new());
    }
    let heading = "Frequency responses of the stage";
    let svg = overlay_bode_svg(Unit::MetresPerAmpere, &measured, heading)?;
    Ok(section(heading, &picture(&svg, heading, FRF_CAPTION)))
}

fn steps(runs: &[RunResult]) -> Result<String, ReportError> {
    let found = runs
        .iter()
        .filter_map(|run| Some((run.label.as_str(), run.control.as_ref()?.measured_step()?)));
    let found: Vec<(&str, &StepResponse)> = found.collect();
    let heading = "Step response";
    let svg = match found[..] {
        [] => return Ok(String::new()),
        [(_, step)] => step_picture(step, heading)?,
        _ => overlay(&found, heading)?,
    };
    let picture = picture(&svg, heading, STEP_CAPTION);
    Ok(section(heading, &(picture + &figures(&found))))
}

/// A measured step beside that of the model.
pub(super) fn step_picture(step: &StepResponse, heading: &str) -> Result<String, ReportError> {
    let drawn_s = drawn_s(step);
    let (measured, predicted) = (
        step.measured_points(drawn_s),
        step.predicted_points(drawn_s),
    );
    let plot = StepPlot {
        height_m: step.height_m,
        measured: &measured,
        predicted: &predicted,
    };
    step_svg(&plot, heading)
}

fn overlay(steps: &[(&str, &StepResponse)], heading: &str) -> Result<String, ReportError> {
    let longest_s = steps
        .iter()
        .map(|(_, step)| drawn_s(step))
        .fold(0.0, f64::max);
    let points: Vec<Vec<(f64, f64)>> = steps
        .iter()
        .map(|(_, step)| step.measured_points(longest_s))
        .collect();
    let curves: Vec<StepCurve> = steps
        .iter()
        .zip(&points)
        .map(|((name, _), points)| StepCurve { name, points })
        .collect();
    overlay_steps_svg(&curves, heading)
}

/// How much of a step is drawn: some settling times, measured or predicted.
fn drawn_s(step: &StepResponse) -> f64 {
    let measured_s = step
        .metrics
        .and_then(|metrics| metrics.step?.settling_time_s);
    let predicted = step.predicted.as_ref();
    let predicted_s = predicted.and_then(|predicted| predicted.metrics.settling_time_s);
    let settling_s = measured_s
        .into_iter()
        .chain(predicted_s)
        .fold(0.0, f64::max);
    let whole_s = step.positions_m.len() as f64 * step.period_s;
    let wanted_s = if settling_s > 0.0 {
        SETTLING_TIMES * settling_s
    } else {
        whole_s
    };
    wanted_s.clamp(DRAWN_S.0, DRAWN_S.1).min(whole_s)
}

/// Reference, position and current of a whole run.
pub(super) fn signals_section(overview: &Overview) -> Result<String, ReportError> {
    let envelope = |extents: &[Extent]| -> Vec<(f64, f64, f64)> {
        let extents = extents.iter();
        extents.map(|e| (e.time_s, e.min, e.max)).collect()
    };
    let heading = "Signals";
    let [reference, position, current] = [
        &overview.reference_m,
        &overview.position_m,
        &overview.current_a,
    ]
    .map(|extents| envelope(extents));
    let plot = SignalsPlot {
        reference: &reference,
        position: &position,
        current: &current,
        ..SignalsPlot::default()
    };
    let svg = signals_svg(&plot, heading, "")?;
    Ok(section(heading, &picture(&svg, heading, SIGNALS_CAPTION)))
}

fn figures(steps: &[(&str, &StepResponse)]) -> String {
    let text = "A settling time is given if the band of 2 % is above three sigma of the error.";
    note(text) + &step_table(steps).html()
}
