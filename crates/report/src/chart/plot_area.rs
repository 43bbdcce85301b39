//! Drawing of one chart: frame, grid, numbers and marks.

use super::Points;
use super::axis::{Axis, Direction, Tick};
use super::canvas::{Canvas, rectangle};
use super::colours::{Colour, FINE_GRID, FRAME, GRID};
use super::frame::Frame;
use super::header::{CHARACTER, TEXT_SIZE};
use super::mark::{Anchor, Mark, Pen, SeriesPoint, Symbol};
use super::scale::Scale;
use super::series::{self, Sample};
use super::symbols::{arrow_heads, draw_arrow, draw_stroke, draw_symbol};
use super::text_style::{Horizontal, TextStyle, Vertical};

/// Pixels from the frame to the middle of the label of the vertical axis.
const LABEL_LEFT: f64 = 66.0;
const LABEL: TextStyle = TextStyle::new(13.0, Horizontal::Centre, Vertical::Middle).upward();
const NUMBER_BELOW: TextStyle = TextStyle::new(12.0, Horizontal::Centre, Vertical::Top);
const NUMBER_LEFT: TextStyle = TextStyle::new(12.0, Horizontal::Right, Vertical::Middle);
const TEXT: TextStyle = TextStyle::new(TEXT_SIZE, Horizontal::Centre, Vertical::Middle);
const TEXT_FROM: TextStyle = TextStyle::new(TEXT_SIZE, Horizontal::Left, Vertical::Middle);
/// Pixels between a text and the frame at its sides, and between its middle and the frame above and below.
const TEXT_ROOM: (f64, f64) = (3.0, 0.6 * TEXT_SIZE + 2.0);

/// Opacity of a band, and of the faint part of a series.
pub(super) const BAND: f64 = 0.22;
const FAINT: f64 = 0.3;
/// Opacity of the band of a single point.
const ISOLATED_BAND: f64 = 0.5;
/// A series with dots and fewer points than this has a dot at each.
const FEW_POINTS: usize = 150;
/// Radius of these dots.
const DOT: f64 = 2.0;

/// A frame with two axes.
pub(super) struct PlotArea {
    pub frame: Frame,
    pub x: Axis,
    pub y: Axis,
}

impl PlotArea {
    /// Grid and numbers.
    pub fn draw_ticks(&self, canvas: &mut Canvas, x: &Scale, y: &Scale) {
        let x_ticks = self.x.ticks(x, Direction::Horizontal);
        let y_ticks = self.y.ticks(y, Direction::Vertical);
        self.draw_grid(canvas, &x_ticks, &y_ticks, false);
        self.draw_grid(canvas, &x_ticks, &y_ticks, true);
        for tick in &y_ticks {
            let at = (self.frame.left - 6.0, self.y.pixel(tick.value));
            draw_number(canvas, tick, at, NUMBER_LEFT);
        }
        for tick in &x_ticks {
            let at = (self.x.pixel(tick.value), self.frame.bottom + 6.0);
            draw_number(canvas, tick, at, NUMBER_BELOW);
        }
    }

    fn draw_grid(&self, canvas: &mut Canvas, x: &[Tick], y: &[Tick], labelled: bool) {
        let (colour, width) = if labelled {
            (GRID, 0.8)
        } else {
            (FINE_GRID, 0.6)
        };
        let frame = self.frame;
        for tick in x.iter().filter(|tick| tick.label.is_some() == labelled) {
            let x = self.x.pixel(tick.value);
            canvas.line(&[(x, frame.top), (x, frame.bottom)], colour, width);
        }
        for tick in y.iter().filter(|tick| tick.label.is_some() == labelled) {
            let y = self.y.pixel(tick.value);
            canvas.line(&[(frame.left, y), (frame.right, y)], colour, width);
        }
    }

    /// The frame, and the label of the vertical axis.
    pub fn draw_frame(&self, canvas: &mut Canvas, y: &Scale) {
        let frame = self.frame;
        let mut outline = rectangle((frame.left, frame.top), (frame.right, frame.bottom));
        outline.extend([(frame.left, frame.top), (frame.right, frame.top)]);
        canvas.line(&outline, FRAME, 0.8);
        let middle = (frame.top + frame.bottom) / 2.0;
        canvas.text(&y.label, (frame.left - LABEL_LEFT, middle), LABEL);
    }

    pub fn draw_mark(&self, canvas: &mut Canvas, mark: &Mark) {
        match mark {
            Mark::Line {
                pen,
                points,
                directed,
                ..
            } => self.draw_line(canvas, *pen, points, *directed),
            Mark::Series {
                pen, points, dots, ..
            } => self.draw_series(canvas, *pen, points, *dots),
            Mark::Arrow { pen, from, to, .. } => {
                draw_arrow(canvas, *pen, self.place(from), self.place(to));
            }
            Mark::Points {
                colour,
                symbol,
                points,
                ..
            } => self.draw_points(canvas, *colour, *symbol, points),
            Mark::Area {
                colour,
                strength,
                outline,
                ..
            } => self.draw_area(canvas, *colour, *strength, outline),
            Mark::Cells {
                x,
                y,
                rows,
                colours,
            } => self.draw_cells(canvas, (x, y), rows, colours),
            Mark::Text {
                at,
                offset,
                anchor,
                text,
                colour,
            } => {
                let (x, y) = self.place(at);
                let place = (x + offset.0, y + offset.1);
                self.draw_text(canvas, place, *anchor, text, *colour);
            }
        }
    }

    pub fn place(&self, (x, y): &(f64, f64)) -> (f64, f64) {
        (self.x.place(*x), self.y.place(*y))
    }

    fn places(&self, points: &[(f64, f64)]) -> Points {
        points.iter().map(|point| self.place(point)).collect()
    }

    fn draw_line(&self, canvas: &mut Canvas, pen: Pen, points: &[(f64, f64)], directed: bool) {
        let places = self.places(points);
        for part in self.frame.clipped(&places) {
            draw_stroke(canvas, pen, 1.0, &part);
            if directed {
                self.draw_arrow_heads(canvas, pen, &part);
            }
        }
        let alone = isolated(&places);
        for place in alone.filter(|place| self.frame.contains(*place)) {
            canvas.dot(place, DOT, pen.colour);
        }
    }

    /// Arrow heads along a line, where they are wholly inside the frame.
    fn draw_arrow_heads(&self, canvas: &mut Canvas, pen: Pen, points: &[(f64, f64)]) {
        let is_inside = |head: &Points| head.iter().all(|corner| self.frame.contains(*corner));
        for head in arrow_heads(points).into_iter().filter(is_inside) {
            canvas.area(&head, pen.colour);
        }
    }

    fn draw_series(&self, canvas: &mut Canvas, pen: Pen, points: &[SeriesPoint], dots: bool) {
        let samples: Vec<Sample> = points.iter().map(|point| self.sample(point)).collect();
        let columns = series::columns(&samples);
        let banded = samples.iter().any(|sample| sample.band.0 < sample.band.1);
        for outline in series::bands(&columns).iter().filter(|_| banded) {
            canvas.area(outline, pen.colour.with_opacity(BAND));
        }
        for piece in series::pieces(&columns) {
            draw_stroke(canvas, pen, opacity(piece.faint), &piece.points);
        }
        draw_isolated_bands(canvas, pen.colour, &samples);
        let all = dots && samples.len() < FEW_POINTS;
        draw_dots(canvas, pen, &samples, all);
    }

    fn sample(&self, point: &SeriesPoint) -> Sample {
        Sample {
            at: (self.x.pixel(point.x), self.y.pixel(point.y)),
            band: (self.y.pixel(point.band.1), self.y.pixel(point.band.0)),
            faint: point.faint,
            starts: point.starts,
        }
    }

    fn draw_points(
        &self,
        canvas: &mut Canvas,
        colour: Colour,
        symbol: Symbol,
        points: &[(f64, f64)],
    ) {
        let places = self.places(points).into_iter();
        for place in places.filter(|place| self.frame.contains(*place)) {
            draw_symbol(canvas, colour, symbol, place);
        }
    }

    fn draw_area(
        &self,
        canvas: &mut Canvas,
        colour: Colour,
        strength: f64,
        outline: &[(f64, f64)],
    ) {
        // A logarithmic axis has no place for values of 0 and below.
        let places = self
            .places(outline)
            .into_iter()
            .filter(|(x, y)| !(x.is_nan() || y.is_nan()));
        let corners: Points = places.map(|place| self.frame.nearest(place)).collect();
        if corners.len() >= 3 {
            canvas.area(&corners, colour.with_opacity(strength));
        }
    }

    /// Neighbouring cells of one colour in a row become one rectangle.
    fn draw_cells(
        &self,
        canvas: &mut Canvas,
        (x, y): (&[f64], &[f64]),
        rows: &[Vec<usize>],
        colours: &[(String, Colour)],
    ) {
        for (row, edges) in rows.iter().zip(y.windows(2)) {
            let mut from = 0;
            for run in row.chunk_by(|a, b| a == b) {
                let to = (from + run.len()).min(x.len() - 1);
                if let Some((_, colour)) = colours.get(run[0]) {
                    let cell = self.cell((x[from], edges[0]), (x[to], edges[1]));
                    canvas.area(&cell, *colour);
                }
                from = to;
            }
        }
    }

    /// A rectangle between two corners, half a pixel higher: the next row covers that part, and no seam is left.
    fn cell(&self, lower_left: (f64, f64), upper_right: (f64, f64)) -> Points {
        let start = self.frame.nearest(self.place(&lower_left));
        let end = self.frame.nearest(self.place(&upper_right));
        let end = self.frame.nearest((end.0, end.1 - 0.5));
        rectangle(start, end)
    }

    /// Text, moved into the frame.
    fn draw_text(
        &self,
        canvas: &mut Canvas,
        place: (f64, f64),
        anchor: Anchor,
        text: &str,
        colour: Colour,
    ) {
        if place.0.is_nan() || place.1.is_nan() {
            return;
        }
        let frame = self.frame;
        let width = CHARACTER * TEXT_SIZE * text.chars().count() as f64;
        let (style, left, right) = match anchor {
            Anchor::Start => (TEXT_FROM, 0.0, width),
            Anchor::Middle => (TEXT, 0.5 * width, 0.5 * width),
        };
        let x = moved_between(
            place.0,
            frame.left + left + TEXT_ROOM.0,
            frame.right - right - TEXT_ROOM.0,
        );
        let y = moved_between(place.1, frame.top + TEXT_ROOM.1, frame.bottom - TEXT_ROOM.1);
        canvas.text(text, (x, y), style.colour(colour));
    }
}

/// The nearest value between two ends; their middle where there is none.
fn moved_between(value: f64, low: f64, high: f64) -> f64 {
    if low < high {
        value.clamp(low, high)
    } else {
        0.5 * (low + high)
    }
}

fn draw_number(canvas: &mut Canvas, tick: &Tick, at: (f64, f64), style: TextStyle) {
    match &tick.label {
        Some(label) if !label.is_empty() => canvas.text(label, at, style),
        _ => {}
    }
}

fn opacity(faint: bool) -> f64 {
    if faint { FAINT } else { 1.0 }
}

/// The bands of single points between gaps, whose outline has no area.
fn draw_isolated_bands(canvas: &mut Canvas, colour: Colour, samples: &[Sample]) {
    for (k, sample) in samples.iter().enumerate() {
        let (upper, lower) = sample.band;
        if is_isolated(samples, k) && upper < lower {
            let ends = [(sample.at.0, upper), (sample.at.0, lower)];
            canvas.line(&ends, colour.with_opacity(ISOLATED_BAND), DOT);
        }
    }
}

/// Whether a gap lies on either side of a point.
fn is_isolated(samples: &[Sample], k: usize) -> bool {
    samples[k].starts && samples.get(k + 1).is_none_or(|next| next.starts)
}

/// Dots at all points, or at single points between gaps.
fn draw_dots(canvas: &mut Canvas, pen: Pen, samples: &[Sample], all: bool) {
    for (k, sample) in samples.iter().enumerate() {
        if all || is_isolated(samples, k) {
            let radius = DOT.max(if all { pen.width } else { 0.5 * pen.width });
            canvas.dot(
                sample.at,
                radius,
                pen.colour.with_opacity(opacity(sample.faint)),
            );
        }
    }
}

/// The points of a line between two gaps, or between a gap and its end, which no stroke shows.
fn isolated(places: &[(f64, f64)]) -> impl Iterator<Item = (f64, f64)> {
    let is_finite = |k: usize| {
        let place = places.get(k);
        place.is_some_and(|(x, y)| x.is_finite() && y.is_finite())
    };
    let indices = (0..places.len())
        .filter(move |k| is_finite(*k) && !is_finite(*k + 1) && !(*k > 0 && is_finite(*k - 1)));
    indices.map(|k| places[k])
}
