//! Layout of a sheet: rows of charts below a title.

use super::Chart;
use super::attributes;
use super::axis::Axis;
use super::canvas::Canvas;
use super::frame::Frame;
use super::header::TextBlock;
use super::legend::Legend;
use super::mark::Mark;
use super::plot_area::PlotArea;
use super::scale::{Scale, ScaleKind};
use super::text_style::{Horizontal, TextStyle, Vertical};
use crate::ReportError;

/// Width of the sheet in pixels.
const WIDTH: f64 = 1000.0;
/// Left and right edge of title and subtitle.
const HEADER_EDGES: (f64, f64) = (16.0, WIDTH - 16.0);
/// Pixels left and right of a frame.
const BESIDE: (f64, f64) = (78.0, 22.0);
/// Pixels below a frame: with numbers and label, and without.
const BELOW: f64 = 50.0;
const BELOW_UNNUMBERED: f64 = 8.0;
/// Part of an axis left free beside the marks.
const MARGIN: f64 = 0.05;
const HEADING: TextStyle = TextStyle::new(13.0, Horizontal::Left, Vertical::Top).bold();
const AXIS_LABEL: TextStyle = TextStyle::new(13.0, Horizontal::Centre, Vertical::Bottom);

/// A row of charts with frames of one height.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Height of the frames in pixels.
    pub height: f64,
    /// Charts from left to right.
    pub charts: Vec<Chart>,
}

impl Row {
    /// Charts side by side.
    pub fn new(height: f64, charts: Vec<Chart>) -> Row {
        Row { height, charts }
    }

    /// Pixels below the frames.
    fn space_below(&self) -> f64 {
        if self.charts.iter().any(|chart| chart.x.numbered) {
            BELOW
        } else {
            BELOW_UNNUMBERED
        }
    }

    /// Left and right edge of each frame.
    fn edges(&self) -> Vec<(f64, f64)> {
        let width = WIDTH / self.charts.len() as f64;
        (0..self.charts.len())
            .map(|k| {
                (
                    k as f64 * width + BESIDE.0,
                    (k + 1) as f64 * width - BESIDE.1,
                )
            })
            .collect()
    }
}

/// Rows of charts below a title, as an SVG document.
///
/// # Errors
/// [`ReportError::NoTrace`] without a chart.
pub fn sheet_svg(title: &str, subtitle: &str, rows: &[Row]) -> Result<String, ReportError> {
    let rows: Vec<&Row> = rows.iter().filter(|row| !row.charts.is_empty()).collect();
    if rows.is_empty() {
        return Err(ReportError::NoTrace);
    }
    let header = TextBlock::header(title, subtitle, HEADER_EDGES);
    let mut bottom = header.bottom + 12.0;
    let mut cells = Vec::new();
    for row in rows {
        cells.extend(cells_of(row, &mut bottom));
    }
    let mut canvas = Canvas::new((WIDTH, bottom));
    header.draw(&mut canvas);
    for cell in &cells {
        cell.draw(&mut canvas);
    }
    Ok(canvas.into_svg())
}

/// The cells of a row from `top` on, which becomes its lower end.
fn cells_of<'a>(row: &'a Row, top: &mut f64) -> Vec<Cell<'a>> {
    let charts = row.charts.iter().zip(row.edges());
    let heads: Vec<Head> = charts
        .map(|(chart, edges)| Head::new(chart, edges, *top))
        .collect();
    let lower_ends = heads.iter().map(|head| head.legend.bottom + 4.0);
    let frame_top = lower_ends.fold(*top, f64::max);
    let bottom = frame_top + row.height;
    *top = bottom + row.space_below();
    let frames = row.edges().into_iter().map(|(left, right)| Frame {
        left,
        right,
        top: frame_top,
        bottom,
    });
    let cells = row.charts.iter().zip(heads).zip(frames);
    cells
        .map(|((chart, head), frame)| Cell::new(chart, head, frame))
        .collect()
}

/// Heading and legend of a chart.
struct Head {
    heading: TextBlock,
    legend: Legend,
}

impl Head {
    fn new(chart: &Chart, edges: (f64, f64), top: f64) -> Head {
        let mut heading = TextBlock::new(edges.0, top + 4.0);
        heading.append(&chart.heading, HEADING, edges.1);
        let listed: &[Mark] = if chart.legend { &chart.marks } else { &[] };
        let legend = Legend::new(listed, edges, heading.bottom);
        Head { heading, legend }
    }
}

/// A chart in its place.
struct Cell<'a> {
    chart: &'a Chart,
    head: Head,
    area: PlotArea,
}

impl<'a> Cell<'a> {
    fn new(chart: &'a Chart, head: Head, frame: Frame) -> Cell<'a> {
        let (x, y) = axes(chart, frame);
        let area = PlotArea { frame, x, y };
        Cell { chart, head, area }
    }

    fn draw(&self, canvas: &mut Canvas) {
        self.head.heading.draw(canvas);
        self.head.legend.draw(canvas);
        canvas.open(&attributes::plot(self.chart, &self.area));
        self.draw_axes(canvas);
        canvas.open("class=\"marks\"");
        // Areas first: they would cover the curves.
        let (areas, others): (Vec<_>, Vec<_>) =
            self.chart.marks.iter().partition(|mark| mark.is_area());
        for mark in areas.into_iter().chain(others) {
            self.draw_mark(canvas, mark);
        }
        canvas.close();
        canvas.close();
    }

    fn draw_axes(&self, canvas: &mut Canvas) {
        let (x, y, frame) = (&self.chart.x, &self.chart.y, self.area.frame);
        canvas.open("class=\"ticks\"");
        self.area.draw_ticks(canvas, x, y);
        canvas.close();
        self.area.draw_frame(canvas, y);
        if x.numbered {
            let middle = (frame.left + frame.right) / 2.0;
            let below = (middle, frame.bottom + BELOW - 8.0);
            canvas.text(&x.label, below, AXIS_LABEL);
        }
    }

    fn draw_mark(&self, canvas: &mut Canvas, mark: &Mark) {
        let attributes = attributes::mark(mark, &self.area);
        if let Some(attributes) = &attributes {
            canvas.open(attributes);
        }
        self.area.draw_mark(canvas, mark);
        if attributes.is_some() {
            canvas.close();
        }
    }
}

/// Both axes of a chart over its frame.
fn axes(chart: &Chart, frame: Frame) -> (Axis, Axis) {
    let (mut x, mut y) = ranges(chart);
    if chart.equal {
        let unit = f64::max((x.1 - x.0) / frame.width(), (y.1 - y.0) / frame.height());
        (x, y) = (
            about(x, unit * frame.width()),
            about(y, unit * frame.height()),
        );
    }
    let horizontal = Axis::new(chart.x.kind, x, (frame.left, frame.right));
    (
        horizontal,
        Axis::new(chart.y.kind, y, (frame.bottom, frame.top)),
    )
}

/// Ends of both axes; those of the vertical one cover the marks within the horizontal one.
fn ranges(chart: &Chart) -> ((f64, f64), (f64, f64)) {
    let points: Vec<(f64, f64)> = chart.marks.iter().flat_map(|mark| mark.extent()).collect();
    let (low, high) = chart.x.range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
    let visible = points
        .iter()
        .filter(|point| (low..=high).contains(&point.0));
    let x = ends(&chart.x, points.iter().map(|point| point.0));
    (x, ends(&chart.y, visible.map(|point| point.1)))
}

/// The range of an axis, or that of the values with a margin.
fn ends(scale: &Scale, values: impl Iterator<Item = f64>) -> (f64, f64) {
    match (scale.range, scale.kind) {
        (Some(range), _) => range,
        (None, ScaleKind::Logarithmic) => {
            let logs = values.filter(|value| *value > 0.0).map(libm::log10);
            let (low, high) = with_margin(logs, |_| 0.1);
            (libm::pow(10.0, low), libm::pow(10.0, high))
        }
        (None, _) => with_margin(values, |largest| 1e-9 * largest.max(1e-300)),
    }
}

/// The range of the finite values with a margin; `least` gives its least width by the largest magnitude.
fn with_margin(values: impl Iterator<Item = f64>, least: impl Fn(f64) -> f64) -> (f64, f64) {
    let finite = values.filter(|value| value.is_finite());
    let (low, high) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    });
    let (low, high) = if low > high { (0.0, 1.0) } else { (low, high) };
    let width = (high - low).max(least(low.abs().max(high.abs())));
    about((low, high), width * (1.0 + 2.0 * MARGIN))
}

/// A range of given width about the middle of another.
fn about((low, high): (f64, f64), width: f64) -> (f64, f64) {
    let middle = 0.5 * (low + high);
    (middle - 0.5 * width, middle + 0.5 * width)
}
