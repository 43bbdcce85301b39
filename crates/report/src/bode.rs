//! The Bode plot: magnitude, phase and coherence over one logarithmic frequency axis.

use super::ReportError;
use super::chart::{Chart, Mark, Row, Scale, SeriesPoint, sheet_svg};
use super::magnitude::{MagnitudeAxis, MagnitudeScale};
use super::trace::{self, Line, Trace};
use bench_identify::Unit;

/// Heights of the panels for magnitude, phase and coherence in pixels.
pub(super) const MAGNITUDE_HEIGHT: f64 = 320.0;
pub(super) const PHASE_HEIGHT: f64 = 243.0;
pub(super) const COHERENCE_HEIGHT: f64 = 132.0;
/// Heading of a phase that is not unwrapped.
pub(super) const WRAPPED: &str = "Phase between ±180°, not unwrapped: neighbouring points differ by more than 120°, or are too noisy";
/// Part of an axis left free above and below the curves.
const MARGIN: f64 = 0.06;
/// Smallest height of the magnitude axis in decades.
const MIN_DECADES: f64 = 1.0;
/// Smallest height of the phase axis in degrees.
const MIN_DEGREES: f64 = 180.0;

/// The Bode plot of some responses, as an SVG document.
///
/// Magnitude in `unit` on a logarithmic axis, phase in degrees, unwrapped from the lowest frequency on, and the coherence of
/// measured traces, if there are any. Measured curves have a band of two sigma; where it reaches zero magnitude the curve
/// is drawn faint and does not widen the axes. Models are drawn on top, dashed over measured curves. Phases are not unwrapped where
/// this would be a guess: see [`has_ambiguous_phase`](super::has_ambiguous_phase).
///
/// ```
/// use bench_identify::Unit;
/// use bench_report::{Trace, bode_svg};
/// use nalgebra::Complex;
///
/// let frequency_hz = [1.0, 10.0, 100.0];
/// let response = frequency_hz.map(|f| Complex::new(1e-3, 0.0) / Complex::new(1.0, f / 10.0));
/// let svg = bode_svg(Unit::MetresPerAmpere, &[Trace::model("low pass", &frequency_hz, &response)], "Title", "")?;
/// assert!(svg.contains("Phase (deg)"));
/// # Ok::<(), bench_report::ReportError>(())
/// ```
///
/// # Errors
/// When there is nothing to draw, or a trace is invalid: see [`ReportError`].
pub fn bode_svg(
    unit: Unit,
    traces: &[Trace],
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let mut lines = trace::lines(traces)?;
    // Stable: measured traces first, so that models lie on top.
    lines.sort_by_key(|line| line.measured.is_none());
    sheet(unit, &lines, title, subtitle)
}

/// Magnitude, phase and coherence of lines, in their order.
pub(super) fn sheet(
    unit: Unit,
    lines: &[Line],
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let scale = MagnitudeScale::new(unit, MagnitudeAxis::Logarithmic);
    let charts = [
        (MAGNITUDE_HEIGHT, magnitude(scale, lines)?),
        (PHASE_HEIGHT, phase(lines)),
    ];
    let coherence = coherence(lines).map(|chart| (COHERENCE_HEIGHT, chart));
    stacked(charts.into_iter().chain(coherence), lines, title, subtitle)
}

/// Charts with their heights, below each other over the frequencies of lines, which are numbered below the last chart.
pub(super) fn stacked(
    charts: impl IntoIterator<Item = (f64, Chart)>,
    lines: &[Line],
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let numbered = Scale::frequency(frequency_range(lines));
    let mut rows = Vec::new();
    for (height, chart) in charts {
        let x = numbered.clone().unnumbered();
        rows.push(Row::new(height, vec![Chart { x, ..chart }]));
    }
    if let Some(last) = rows.last_mut() {
        last.charts[0].x = numbered;
    }
    sheet_svg(title, subtitle, &rows)
}

/// A chart whose horizontal axis is that of its sheet.
pub(super) fn panel(y: Scale) -> Chart {
    Chart::new("", Scale::logarithmic(""), y)
}

/// The magnitudes of lines.
pub(super) fn magnitude(scale: MagnitudeScale, lines: &[Line]) -> Result<Chart, ReportError> {
    let range = magnitude_range(lines).ok_or(ReportError::NoMagnitude)?;
    let chart = panel(scale.axis("Magnitude", range));
    Ok(lines.iter().fold(chart, |chart, line| {
        let points = line.magnitude_points().into_iter();
        let points = points.map(|point| scale.point(point)).collect();
        chart.mark(series(legend_name(line), line, points))
    }))
}

/// The phases of lines.
pub(super) fn phase(lines: &[Line]) -> Chart {
    let (low, high) = phase_range(lines);
    let mut chart = panel(Scale::degrees("Phase (deg)").within(low, high)).without_legend();
    if lines.iter().any(|line| line.is_wrapped) {
        chart.heading = WRAPPED.into();
    }
    lines.iter().fold(chart, |chart, line| {
        chart.mark(series(line.name.to_owned(), line, line.phase_points()))
    })
}

/// The coherence of measured responses, if there are any.
pub(super) fn coherence(lines: &[Line]) -> Option<Chart> {
    lines.iter().find(|line| line.measured.is_some())?;
    let chart = panel(Scale::linear("Coherence").within(0.0, 1.05)).without_legend();
    Some(lines.iter().fold(chart, |chart, line| match line.measured {
        Some(frf) => chart.mark(series(
            line.name.to_owned(),
            line,
            coherence_points(line, &frf.coherence),
        )),
        None => chart,
    }))
}

fn coherence_points(line: &Line, coherence: &[f64]) -> Vec<SeriesPoint> {
    let points = line.magnitude_points().into_iter().zip(coherence);
    points
        .map(|(point, y)| SeriesPoint {
            y: *y,
            band: (*y, *y),
            faint: false,
            ..point
        })
        .collect()
}

fn series(name: String, line: &Line, points: Vec<SeriesPoint>) -> Mark {
    Mark::Series {
        name,
        pen: line.pen,
        points,
        dots: line.measured.is_some(),
    }
}

fn legend_name(line: &Line) -> String {
    match line.measured {
        Some(_) => format!("{} (band: ±{}σ)", line.name, trace::BAND_SIGMAS),
        None => line.name.to_owned(),
    }
}

/// The range of all frequencies; a single frequency gets a third of an octave to either side.
fn frequency_range(lines: &[Line]) -> (f64, f64) {
    let frequencies = lines
        .iter()
        .flat_map(|line| line.frequency_hz.iter().copied());
    let (low, high) = range(frequencies).unwrap_or((1.0, 1.0));
    if low < high {
        (low, high)
    } else {
        (low / 1.26, high * 1.26)
    }
}

/// The range of the magnitudes that are certain, or of all if none is certain, with a margin: at least a decade.
fn magnitude_range(lines: &[Line]) -> Option<(f64, f64)> {
    let logs = [false, true].into_iter().find_map(|all| {
        let magnitudes = lines
            .iter()
            .flat_map(|line| visible(line, &line.magnitude, all));
        let positive = magnitudes.filter(|magnitude| *magnitude > 0.0);
        range(positive.map(libm::log10))
    });
    let (low, high) = with_margin(logs?, MIN_DECADES);
    Some((libm::pow(10.0, low), libm::pow(10.0, high)))
}

/// The range of the phases, likewise: at least half a turn.
fn phase_range(lines: &[Line]) -> (f64, f64) {
    if lines.iter().any(|line| line.is_wrapped) {
        return with_margin((-180.0, 180.0), MIN_DEGREES);
    }
    let phases = [false, true].into_iter().find_map(|all| {
        range(
            lines
                .iter()
                .flat_map(|line| visible(line, &line.phase_deg, all)),
        )
    });
    with_margin(phases.unwrap_or((0.0, 0.0)), MIN_DEGREES)
}

/// The values that widen an axis: those that are certain, or all.
fn visible<'a>(line: &'a Line, values: &'a [f64], all: bool) -> impl Iterator<Item = f64> + 'a {
    let certain = values.iter().zip(&line.certain);
    certain
        .filter(move |(_, certain)| all || **certain)
        .map(|(value, _)| *value)
}

fn range(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    values.fold(None, |range, value| match range {
        None => Some((value, value)),
        Some((low, high)) => Some((value.min(low), value.max(high))),
    })
}

/// A range, widened about its middle to the least width and by the margin.
fn with_margin((low, high): (f64, f64), least: f64) -> (f64, f64) {
    let half = (high - low).max(least) * (0.5 + MARGIN);
    let middle = (low + high) / 2.0;
    (middle - half, middle + half)
}
