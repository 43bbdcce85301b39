//! Charts side by side and below each other on one page.

use plotters::style::text_anchor::{HPos, VPos};

use super::ReportError;
use super::axis::{Axis, Tick};
use super::canvas::{self, Canvas, TextForm};
use super::chart::{Chart, Mark, Pen, Scale, ScaleKind, Stroke, Symbol};
use super::clip::Frame;
use super::colours::{Colour, INK};
use super::curve;
use super::header::{CHARACTER, Header, TEXT_SIZE, flow, wrapped};
use super::panel::{Panel, Ticks};

/// Width of the page in pixels.
const WIDTH: f64 = 1000.0;
/// Room of a chart left and right of its frame.
const BESIDE: (f64, f64) = (78.0, 22.0);
/// Room below a frame for numbers and what they are of.
const FOOT: f64 = 50.0;
const HEADING_SIZE: f64 = 13.0;
const SWATCH: f64 = 26.0;
/// Part of an axis left free beside what is drawn.
const MARGIN: f64 = 0.05;
/// Pixels a labelled tick takes at least, along and up.
const TICK: (f64, f64) = (74.0, 40.0);
const SYMBOL: f64 = 4.5;
/// Pixels between the arrow heads of a line, and their size.
const ARROWS: (f64, f64) = (170.0, 7.0);

/// A row of charts whose frames are of one height in pixels.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Height of the frames.
    pub height: f64,
    /// Left to right.
    pub charts: Vec<Chart>,
}

impl Row {
    /// Charts side by side.
    pub fn new(height: f64, charts: Vec<Chart>) -> Row {
        Row { height, charts }
    }
}

/// Rows of charts below a title, as an SVG document.
///
/// # Errors
/// When there is nothing to draw.
pub fn sheet_svg(title: &str, subtitle: &str, rows: &[Row]) -> Result<String, ReportError> {
    if rows.iter().all(|row| row.charts.is_empty()) {
        return Err(ReportError::NoTrace);
    }
    let header = Header::new(title, subtitle, &[], (16.0, WIDTH - 16.0));
    let mut top = header.bottom - 14.0;
    let mut placed = Vec::new();
    for row in rows.iter().filter(|row| !row.charts.is_empty()) {
        let (cells, bottom) = cells(row, top);
        placed.extend(cells);
        top = bottom;
    }
    canvas::page((WIDTH, top), |canvas| {
        header.draw(canvas, &[])?;
        placed.iter().try_for_each(|cell| cell.draw(canvas))
    })
}

/// A chart in its place.
struct Cell<'a> {
    chart: &'a Chart,
    headings: Vec<(String, f64)>,
    legend: Vec<(Key, (f64, f64))>,
    panel: Panel,
}

/// The cells of a row, and where it ends.
fn cells(row: &Row, top: f64) -> (Vec<Cell<'_>>, f64) {
    let width = WIDTH / row.charts.len() as f64;
    let edges = |k: usize| {
        (
            k as f64 * width + BESIDE.0,
            (k + 1) as f64 * width - BESIDE.1,
        )
    };
    let heads: Vec<_> = row
        .charts
        .iter()
        .enumerate()
        .map(|(k, chart)| head(chart, edges(k), top))
        .collect();
    let frame_top = heads.iter().map(|head| head.2).fold(top, f64::max);
    let bottom = frame_top + row.height;
    let cell = |(k, (headings, legend, _)): (usize, (Vec<_>, Vec<_>, f64))| {
        let chart = &row.charts[k];
        let (left, right) = edges(k);
        let (x, y) = axes(
            chart,
            Frame {
                left,
                right,
                top: frame_top,
                bottom,
            },
        );
        Cell {
            chart,
            headings,
            legend,
            panel: Panel {
                left,
                right,
                top: frame_top,
                bottom,
                x,
                y,
            },
        }
    };
    (
        heads.into_iter().enumerate().map(cell).collect(),
        bottom + FOOT,
    )
}

/// A head's rows of words, its legend, and where it ends.
type Head = (Vec<(String, f64)>, Vec<(Key, (f64, f64))>, f64);

/// Heading and legend of a chart.
fn head(chart: &Chart, (left, right): (f64, f64), top: f64) -> Head {
    let mut y = top + 4.0;
    let mut headings = Vec::new();
    for row in wrapped(
        &chart.heading,
        ((right - left) / (0.62 * HEADING_SIZE)) as usize,
    ) {
        headings.push((row, y));
        y += 1.4 * HEADING_SIZE;
    }
    let keys: Vec<Key> = chart.marks.iter().flat_map(keys).collect();
    let width =
        |key: &Key| SWATCH + 6.0 + CHARACTER * TEXT_SIZE * key.name.chars().count() as f64 + 18.0;
    let places = flow(
        &keys.iter().map(width).collect::<Vec<_>>(),
        (left, right),
        y,
    );
    let bottom = places.last().map_or(y, |place| place.1 + 20.0) + 4.0;
    (headings, keys.into_iter().zip(places).collect(), bottom)
}

/// An entry of a legend.
struct Key {
    name: String,
    sample: Sample,
}

enum Sample {
    Line(Pen),
    Point(Colour, Symbol),
    Area(Colour, f64),
}

fn keys(mark: &Mark) -> Vec<Key> {
    let named = |name: &String, sample: Sample| match name.is_empty() {
        true => Vec::new(),
        false => vec![Key {
            name: name.clone(),
            sample,
        }],
    };
    match mark {
        Mark::Line { name, pen, .. } => named(name, Sample::Line(*pen)),
        Mark::Points {
            name,
            colour,
            symbol,
            ..
        } => named(name, Sample::Point(*colour, *symbol)),
        Mark::Area {
            name,
            colour,
            strength,
            ..
        } => named(name, Sample::Area(*colour, *strength)),
        Mark::Cells { colours, .. } => colours
            .iter()
            .flat_map(|(name, colour)| named(name, Sample::Area(*colour, 1.0)))
            .collect(),
        Mark::Text { .. } => Vec::new(),
    }
}

/// All places of a mark.
fn places(mark: &Mark) -> Vec<(f64, f64)> {
    match mark {
        Mark::Line { points, .. } | Mark::Points { points, .. } => points.clone(),
        Mark::Area { outline, .. } => outline.clone(),
        Mark::Cells { x, y, .. } => [x.first().zip(y.first()), x.last().zip(y.last())]
            .into_iter()
            .flatten()
            .map(|(x, y)| (*x, *y))
            .collect(),
        Mark::Text { at, .. } => vec![*at],
    }
}

/// Both axes of a chart over its frame.
fn axes(chart: &Chart, frame: Frame) -> (Axis, Axis) {
    let all: Vec<(f64, f64)> = chart.marks.iter().flat_map(places).collect();
    let mut x = ends(&chart.x, all.iter().map(|point| point.0));
    // Of the points that the other axis shows.
    let seen = |point: &&(f64, f64)| {
        chart
            .x
            .range
            .is_none_or(|(low, high)| point.0 >= low && point.0 <= high)
    };
    let mut y = ends(&chart.y, all.iter().filter(seen).map(|point| point.1));
    let (width, height) = (frame.right - frame.left, frame.bottom - frame.top);
    if chart.equal {
        let unit = ((x.1 - x.0) / width).max((y.1 - y.0) / height);
        (x, y) = (about(x, unit * width), about(y, unit * height));
    }
    let axis = |scale: &Scale, range, pixels| match scale.kind {
        ScaleKind::Logarithmic => Axis::logarithmic(range, pixels),
        _ => Axis::linear(range, pixels),
    };
    (
        axis(&chart.x, x, (frame.left, frame.right)),
        axis(&chart.y, y, (frame.bottom, frame.top)),
    )
}

fn about((low, high): (f64, f64), width: f64) -> (f64, f64) {
    let middle = 0.5 * (low + high);
    (middle - 0.5 * width, middle + 0.5 * width)
}

/// The ends of an axis: those given, or those of the values with a margin.
fn ends(scale: &Scale, values: impl Iterator<Item = f64>) -> (f64, f64) {
    if let Some(range) = scale.range {
        return range;
    }
    let logarithmic = scale.kind == ScaleKind::Logarithmic;
    let shown = values.filter(|value| value.is_finite() && (!logarithmic || *value > 0.0));
    let shown = shown.map(|value| {
        if logarithmic {
            libm::log10(value)
        } else {
            value
        }
    });
    let (low, high) = shown.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
        (low.min(x), high.max(x))
    });
    let (low, high) = if low > high { (0.0, 1.0) } else { (low, high) };
    let least = if logarithmic {
        0.1
    } else {
        1e-9 * low.abs().max(high.abs()).max(1e-300)
    };
    let (low, high) = about((low, high), (high - low).max(least) * (1.0 + 2.0 * MARGIN));
    if logarithmic {
        (libm::pow(10.0, low), libm::pow(10.0, high))
    } else {
        (low, high)
    }
}

impl Cell<'_> {
    fn frame(&self) -> Frame {
        let Panel {
            left,
            right,
            top,
            bottom,
            ..
        } = self.panel;
        Frame {
            left,
            right,
            top,
            bottom,
        }
    }

    fn at(&self, (x, y): (f64, f64)) -> (f64, f64) {
        (self.panel.x.place(x), self.panel.y.place(y))
    }

    fn draw(&self, canvas: &Canvas) -> Result<(), ReportError> {
        for (text, y) in &self.headings {
            let anchor = (HPos::Left, VPos::Top);
            let form = TextForm {
                size: HEADING_SIZE,
                colour: INK,
                bold: true,
                anchor,
                upward: false,
            };
            canvas.text(text, (self.panel.left, *y), form)?;
        }
        self.legend
            .iter()
            .try_for_each(|(key, place)| draw_key(canvas, key, *place))?;
        // A map covers the grid; everything else stands on it.
        let (maps, others): (Vec<&Mark>, Vec<&Mark>) = self
            .chart
            .marks
            .iter()
            .partition(|mark| matches!(mark, Mark::Cells { .. } | Mark::Area { .. }));
        let ticks = Ticks {
            x: &ticks(&self.chart.x, &self.panel.x, TICK.0),
            y: &ticks(&self.chart.y, &self.panel.y, TICK.1),
            label: &self.chart.y.label,
            frequencies: true,
        };
        self.panel.frame(canvas, &ticks)?;
        maps.into_iter()
            .chain(others)
            .try_for_each(|mark| self.mark(canvas, mark))?;
        let anchor = (HPos::Center, VPos::Bottom);
        let form = TextForm {
            size: HEADING_SIZE,
            colour: INK,
            bold: false,
            anchor,
            upward: false,
        };
        let middle = (self.panel.left + self.panel.right) / 2.0;
        canvas.text(
            &self.chart.x.label,
            (middle, self.panel.bottom + FOOT - 8.0),
            form,
        )
    }

    fn mark(&self, canvas: &Canvas, mark: &Mark) -> Result<(), ReportError> {
        match mark {
            Mark::Line {
                pen,
                points,
                directed,
                ..
            } => self.line(canvas, *pen, points, *directed),
            Mark::Points {
                colour,
                symbol,
                points,
                ..
            } => {
                let inside = points
                    .iter()
                    .map(|point| self.at(*point))
                    .filter(|at| self.frame().holds(*at));
                inside
                    .into_iter()
                    .try_for_each(|at| draw_symbol(canvas, *colour, *symbol, at))
            }
            Mark::Area {
                colour,
                strength,
                outline,
                ..
            } => {
                // A logarithmic axis has no place for values of 0 and below.
                let places = outline
                    .iter()
                    .map(|point| self.at(*point))
                    .filter(|(x, y)| !(x.is_nan() || y.is_nan()));
                let corners: Vec<_> = places.map(|place| self.frame().nearest(place)).collect();
                if corners.len() < 3 {
                    Ok(())
                } else {
                    canvas.area(&corners, colour.mix_with(*strength))
                }
            }
            Mark::Cells {
                x,
                y,
                rows,
                colours,
            } => self.cells(canvas, (x, y), rows, colours),
            Mark::Text {
                at,
                offset,
                text,
                colour,
            } => self.text(canvas, self.at(*at), *offset, text, *colour),
        }
    }

    fn line(
        &self,
        canvas: &Canvas,
        pen: Pen,
        points: &[(f64, f64)],
        directed: bool,
    ) -> Result<(), ReportError> {
        let points: Vec<(f64, f64)> = points.iter().map(|point| self.at(*point)).collect();
        for piece in self.frame().pieces(&points) {
            for dash in dashes(pen.stroke, &piece) {
                canvas.line(&dash, pen.colour.into(), pen.width)?;
            }
            for head in if directed {
                arrow_heads(&piece)
            } else {
                Vec::new()
            } {
                if head.iter().all(|corner| self.frame().holds(*corner)) {
                    canvas.area(&head, pen.colour.into())?;
                }
            }
        }
        Ok(())
    }

    /// Neighbours of one colour in a row are one rectangle.
    fn cells(
        &self,
        canvas: &Canvas,
        (x, y): (&[f64], &[f64]),
        rows: &[Vec<usize>],
        colours: &[(String, Colour)],
    ) -> Result<(), ReportError> {
        for (row, edges) in rows.iter().zip(y.windows(2)) {
            let mut from = 0;
            for run in row.chunk_by(|a, b| a == b) {
                let to = (from + run.len()).min(x.len() - 1);
                let frame = self.frame();
                let corner = |x, y| frame.nearest(self.at((x, y)));
                let (a, c) = (corner(x[from], edges[0]), corner(x[to], edges[1]));
                if let Some((_, colour)) = colours.get(run[0]) {
                    // Half a pixel into the next row, which comes on top: no seam between them.
                    let c = frame.nearest((c.0, c.1 - 0.5));
                    canvas.area(&[a, (c.0, a.1), c, (a.0, c.1)], (*colour).into())?;
                }
                from = to;
            }
        }
        Ok(())
    }

    /// Words within the frame.
    fn text(
        &self,
        canvas: &Canvas,
        at: (f64, f64),
        offset: (f64, f64),
        text: &str,
        colour: Colour,
    ) -> Result<(), ReportError> {
        if at.0.is_nan() || at.1.is_nan() {
            return Ok(());
        }
        let half = (
            0.5 * CHARACTER * TEXT_SIZE * text.chars().count() as f64 + 3.0,
            0.6 * TEXT_SIZE + 2.0,
        );
        let Frame {
            left,
            right,
            top,
            bottom,
        } = self.frame();
        let within = |x: f64, low: f64, high: f64| {
            if low < high {
                x.clamp(low, high)
            } else {
                0.5 * (low + high)
            }
        };
        let x = within(at.0 + offset.0, left + half.0, right - half.0);
        let y = within(at.1 + offset.1, top + half.1, bottom - half.1);
        let anchor = (HPos::Center, VPos::Center);
        canvas.text(
            text,
            (x, y),
            TextForm {
                size: TEXT_SIZE,
                colour,
                bold: false,
                anchor,
                upward: false,
            },
        )
    }
}

fn ticks(scale: &Scale, axis: &Axis, pixels: f64) -> Vec<Tick> {
    match scale.kind {
        ScaleKind::Logarithmic if pixels == TICK.0 => axis.frequency_ticks(),
        ScaleKind::Logarithmic => axis.magnitude_ticks(),
        ScaleKind::Degrees => axis.degree_ticks(),
        ScaleKind::Linear => axis.even_ticks(pixels),
        ScaleKind::Blank => Vec::new(),
    }
}

fn dashes(stroke: Stroke, points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    match stroke {
        Stroke::Solid => vec![points.to_vec()],
        Stroke::Dashed => curve::dashed(points, (7.0, 5.0)),
        Stroke::Dotted => curve::dashed(points, (2.0, 3.5)),
    }
}

/// Triangles along a line that point where it goes.
fn arrow_heads(points: &[(f64, f64)]) -> Vec<Vec<(f64, f64)>> {
    let (mut since, mut heads) = (0.55 * ARROWS.0, Vec::new());
    for pair in points.windows(2) {
        let (dx, dy) = (pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        let length = libm::hypot(dx, dy);
        since += length;
        if since > ARROWS.0 && length > 0.0 {
            let (ux, uy) = (dx / length * ARROWS.1, dy / length * ARROWS.1);
            let tip = (
                pair[0].0 + 0.5 * dx + 0.5 * ux,
                pair[0].1 + 0.5 * dy + 0.5 * uy,
            );
            let back = |side: f64| (tip.0 - ux - side * 0.5 * uy, tip.1 - uy + side * 0.5 * ux);
            heads.push(vec![tip, back(1.0), back(-1.0)]);
            since = 0.0;
        }
    }
    heads
}

fn draw_symbol(
    canvas: &Canvas,
    colour: Colour,
    symbol: Symbol,
    (x, y): (f64, f64),
) -> Result<(), ReportError> {
    let (ink, r) = (colour.into(), SYMBOL);
    match symbol {
        Symbol::Dot => canvas.dot((x, y), 3.2, ink),
        Symbol::Ring => canvas.ring((x, y), r, ink, 1.6),
        Symbol::Cross => {
            canvas.line(&[(x - r, y - r), (x + r, y + r)], ink, 1.8)?;
            canvas.line(&[(x - r, y + r), (x + r, y - r)], ink, 1.8)
        }
    }
}

fn draw_key(canvas: &Canvas, key: &Key, (x, y): (f64, f64)) -> Result<(), ReportError> {
    let (middle, end) = (y + 8.0, x + SWATCH);
    match key.sample {
        Sample::Line(pen) => {
            for dash in dashes(pen.stroke, &[(x, middle), (end, middle)]) {
                canvas.line(&dash, pen.colour.into(), pen.width.max(1.2))?;
            }
        }
        Sample::Point(colour, symbol) => {
            draw_symbol(canvas, colour, symbol, (x + SWATCH - 8.0, middle))?
        }
        Sample::Area(colour, strength) => {
            let (top, bottom, left) = (middle - 6.0, middle + 6.0, x + 6.0);
            let corners = [(left, top), (end, top), (end, bottom), (left, bottom)];
            canvas.area(&corners, colour.mix_with(strength))?;
            canvas.line(
                &[corners[0], corners[1], corners[2], corners[3], corners[0]],
                INK.into(),
                0.5,
            )?;
        }
    }
    let anchor = (HPos::Left, VPos::Center);
    let form = TextForm {
        size: TEXT_SIZE,
        colour: INK,
        bold: false,
        anchor,
        upward: false,
    };
    canvas.text(&key.name, (end + 6.0, middle), form)
}

/// A colour that covers only a part of what is below.
trait Mix {
    fn mix_with(self, strength: f64) -> plotters::style::RGBAColor;
}

impl Mix for Colour {
    fn mix_with(self, strength: f64) -> plotters::style::RGBAColor {
        plotters::style::Color::mix(&self, strength)
    }
}
