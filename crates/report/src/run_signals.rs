//! Reference, position, error and current of a whole run.

use super::ReportError;
use super::chart::colours::{BLUE, GREEN, ORANGE, PURPLE, VERMILION};
use super::chart::{Chart, Pen, Row, Scale, sheet_svg};

/// Heights of the frames for position, error and current in pixels.
const HEIGHTS: [f64; 3] = [280.0, 200.0, 200.0];
const BAND_STRENGTH: f64 = 0.25;
const MICRO: f64 = 1e6;

/// A signal over time: (seconds, smallest and largest value of the interval that begins there).
pub type Envelope = [(f64, f64, f64)];

/// The signals of a run. Units are metres and amperes.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SignalsPlot<'a> {
    /// Reference.
    pub reference: &'a Envelope,
    /// Position.
    pub position: &'a Envelope,
    /// Reference minus position; empty in open loop.
    pub error: &'a Envelope,
    /// Current.
    pub current: &'a Envelope,
    /// The settling band, if the reference is a step.
    pub band: Option<SettlingBand>,
    /// Time in seconds of the trip that ended the run.
    pub trip_s: Option<f64>,
}

/// The band in which a step counts as settled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SettlingBand {
    /// Time of the step in seconds.
    pub from_s: f64,
    /// Position at the end of the step in metres.
    pub target_m: f64,
    /// Half of its height in metres.
    pub half_m: f64,
}

/// Reference, position, error and current of a whole run, below each other.
///
/// # Errors
/// When there is nothing to draw.
pub fn signals_svg(
    plot: &SignalsPlot<'_>,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    if plot.current.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let mut charts = vec![motion(plot)];
    if !plot.error.is_empty() {
        charts.push(error(plot));
    }
    charts.push(current(plot));
    sheet_svg(title, subtitle, &rows(charts))
}

/// The charts below each other over one time axis, numbered below the last chart.
fn rows(mut charts: Vec<Chart>) -> Vec<Row> {
    if let Some(last) = charts.last_mut() {
        last.x = time();
    }
    let rows = charts.into_iter().zip(HEIGHTS);
    rows.map(|(chart, height)| Row::new(height, vec![chart]))
        .collect()
}

fn time() -> Scale {
    Scale::linear("Time (s)")
}

fn panel(label: &str) -> Chart {
    Chart::new("", time().unnumbered(), Scale::linear(label))
}

fn motion(plot: &SignalsPlot<'_>) -> Chart {
    let mut chart = panel("Position (µm)");
    if let Some(band) = plot.band {
        let end_s = end_s(plot);
        let outline = band.outline(band.target_m, end_s);
        chart = chart.area("2 % of the step", GREEN, BAND_STRENGTH, outline);
    }
    let chart = chart
        .line(
            "reference",
            Pen::solid(ORANGE),
            outline(plot.reference, MICRO),
        )
        .line("position", Pen::solid(BLUE), outline(plot.position, MICRO));
    with_trip(
        chart,
        "trip",
        plot.trip_s,
        &[plot.reference, plot.position],
        MICRO,
    )
}

fn error(plot: &SignalsPlot<'_>) -> Chart {
    let mut chart = panel("Error (µm)");
    if let Some(band) = plot.band {
        chart = chart.area("", GREEN, BAND_STRENGTH, band.outline(0.0, end_s(plot)));
    }
    let pen = Pen::solid(PURPLE);
    let chart = chart.line("reference minus position", pen, outline(plot.error, MICRO));
    with_trip(chart, "", plot.trip_s, &[plot.error], MICRO)
}

fn current(plot: &SignalsPlot<'_>) -> Chart {
    let pen = Pen::solid(GREEN);
    let chart = panel("Current (A)").line("current", pen, outline(plot.current, 1.0));
    with_trip(chart, "", plot.trip_s, &[plot.current], 1.0)
}

/// A vertical line at the time of a trip, over the range of the signals.
fn with_trip(
    chart: Chart,
    name: &str,
    trip_s: Option<f64>,
    signals: &[&Envelope],
    factor: f64,
) -> Chart {
    let Some(trip_s) = trip_s else {
        return chart;
    };
    let intervals = signals.iter().flat_map(|signal| signal.iter());
    let (low, high) = intervals.fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(low, high), interval| (low.min(interval.1), high.max(interval.2)),
    );
    let line = vec![(trip_s, factor * low), (trip_s, factor * high)];
    chart.line(name, Pen::dashed(VERMILION), line)
}

/// The last time of the run.
fn end_s(plot: &SignalsPlot<'_>) -> f64 {
    plot.current.last().map_or(0.0, |interval| interval.0)
}

impl SettlingBand {
    /// The corners of the band about a position in metres, in micrometres.
    fn outline(&self, middle_m: f64, end_s: f64) -> Vec<(f64, f64)> {
        let (from_s, to_s) = (self.from_s, end_s.max(self.from_s));
        let [low, high] = [-1.0, 1.0].map(|side| MICRO * (middle_m + side * self.half_m));
        vec![(from_s, low), (to_s, low), (to_s, high), (from_s, high)]
    }
}

/// A line from minimum to maximum of each interval.
fn outline(envelope: &Envelope, factor: f64) -> Vec<(f64, f64)> {
    let points = envelope
        .iter()
        .flat_map(|(time_s, low, high)| [(*time_s, factor * low), (*time_s, factor * high)]);
    points.collect()
}
