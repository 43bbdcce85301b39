//! Steps, and several recordings in one plot.

use super::ReportError;
use super::bode::sheet;
use super::chart::colours::{BLUE, Colour, GREEN, PURPLE, VERMILION};
use super::chart::{Chart, Pen, Row, Scale, Stroke, sheet_svg};
use super::trace::{self, Trace};
use bench_identify::{Frf, Unit};

/// Colours and strokes: their numbers have no common divisor, so that twelve curves differ.
const COLOURS: [Colour; 4] = [BLUE, VERMILION, GREEN, PURPLE];
const STROKES: [Stroke; 3] = [Stroke::Solid, Stroke::Dashed, Stroke::Dotted];
/// Height of the frame of a step plot in pixels.
const STEP_HEIGHT: f64 = 400.0;
const MICRO: f64 = 1e6;
/// Ratio of the height of a step, and opacity of its area.
const SETTLING_BAND: f64 = 0.02;
const BAND_STRENGTH: f64 = 0.25;

/// The response of a recording to a step of its reference.
#[derive(Clone, Debug, PartialEq)]
pub struct StepCurve<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// (Seconds since the step, metres from the rest position.)
    pub points: &'a [(f64, f64)],
}

/// The measured responses of several recordings in one Bode sheet, with their bands. `responses` are names and responses.
///
/// # Errors
/// When there is nothing to draw, or a response is invalid.
pub fn overlay_bode_svg(
    unit: Unit,
    responses: &[(&str, &Frf)],
    title: &str,
) -> Result<String, ReportError> {
    let responses = responses.iter();
    let traces: Vec<Trace> = responses
        .map(|(name, frf)| Trace::measured(name, frf))
        .collect();
    let mut lines = trace::lines(&traces)?;
    for (k, line) in lines.iter_mut().enumerate() {
        line.pen = pen(k);
    }
    sheet(unit, &lines, title, "")
}

/// The step responses of several recordings in one plot.
///
/// # Errors
/// When there is nothing to draw.
pub fn overlay_steps_svg(curves: &[StepCurve<'_>], title: &str) -> Result<String, ReportError> {
    if curves.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let mut chart = step_chart();
    for (k, curve) in curves.iter().enumerate() {
        let points = curve.points.iter().map(|(t, y)| (*t, MICRO * y));
        chart = chart.line(curve.name, pen(k), points.collect());
    }
    sheet_svg(title, "", &[Row::new(STEP_HEIGHT, vec![chart])])
}

/// A step: (seconds since the step, metres from the rest position).
#[derive(Clone, Debug, PartialEq)]
pub struct StepPlot<'a> {
    /// Height of the step in metres.
    pub height_m: f64,
    /// Measured.
    pub measured: &'a [(f64, f64)],
    /// By the model; may be empty.
    pub predicted: &'a [(f64, f64)],
}

/// A step with its band of 2 %, beside that of the model.
///
/// # Errors
/// When there is nothing to draw.
pub fn step_svg(step: &StepPlot<'_>, title: &str) -> Result<String, ReportError> {
    let end_s = step.measured.last().ok_or(ReportError::NoTrace)?.0;
    let [low, high] = [1.0 - SETTLING_BAND, 1.0 + SETTLING_BAND].map(|k| k * MICRO * step.height_m);
    let band = vec![(0.0, low), (end_s, low), (end_s, high), (0.0, high)];
    let micro = |points: &[(f64, f64)]| points.iter().map(|(t, y)| (*t, MICRO * y)).collect();
    let mut chart = step_chart()
        .area("2 % of the step", GREEN, BAND_STRENGTH, band)
        .line("measured", Pen::solid(BLUE), micro(step.measured));
    if !step.predicted.is_empty() {
        let pen = Pen {
            stroke: Stroke::Dashed,
            ..Pen::solid(VERMILION)
        };
        chart = chart.line("by the model", pen, micro(step.predicted));
    }
    sheet_svg(title, "", &[Row::new(STEP_HEIGHT, vec![chart])])
}

fn step_chart() -> Chart {
    let (x, y) = (
        Scale::linear("Time since the step (s)"),
        Scale::linear("Position (µm)"),
    );
    Chart::new("", x, y)
}

/// The pen of a recording: curves differ in colour and in stroke.
fn pen(index: usize) -> Pen {
    Pen {
        stroke: STROKES[index % STROKES.len()],
        ..Pen::solid(COLOURS[index % COLOURS.len()])
    }
}
