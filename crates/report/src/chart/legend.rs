//! The legend of a chart: one entry for each named mark.

use super::Points;
use super::canvas::{Canvas, rectangle};
use super::colours::{Colour, INK, Paint};
use super::header::{CHARACTER, TEXT_SIZE};
use super::mark::{Mark, Pen, SeriesPoint, Symbol};
use super::plot_area::BAND;
use super::series::dashes;
use super::symbols::{draw_arrow, draw_symbol};
use super::text_style::{Horizontal, TextStyle, Vertical};

/// Width of the sample in front of a name.
const SAMPLE_WIDTH: f64 = 26.0;
const ROW_HEIGHT: f64 = 20.0;
/// Pixels between an entry and the next.
const SPACE: f64 = 18.0;
const NAME: TextStyle = TextStyle::new(TEXT_SIZE, Horizontal::Left, Vertical::Middle);

/// Entries, side by side in as many rows as they need.
pub(super) struct Legend {
    entries: Vec<(Entry, (f64, f64))>,
    /// Lower end.
    pub bottom: f64,
}

struct Entry {
    name: String,
    sample: Sample,
}

/// The sample in front of a name.
enum Sample {
    Line(Pen),
    Band(Pen),
    Arrow(Pen),
    Point(Colour, Symbol),
    Area(Colour, f64),
}

impl Legend {
    /// The legend of some marks between two edges.
    pub fn new(marks: &[Mark], edges: (f64, f64), top: f64) -> Self {
        let entries: Vec<Entry> = marks.iter().flat_map(entries).collect();
        let places = flow(entries.iter().map(Entry::width), edges, top);
        let bottom = places.last().map_or(top, |place| place.1 + ROW_HEIGHT);
        Self {
            entries: entries.into_iter().zip(places).collect(),
            bottom,
        }
    }

    pub fn draw(&self, canvas: &mut Canvas) {
        for (entry, place) in &self.entries {
            entry.draw(canvas, *place);
        }
    }
}

/// The entries of a mark: one for each name that is not empty.
fn entries(mark: &Mark) -> Vec<Entry> {
    let samples = samples(mark).into_iter().zip(mark.names());
    samples
        .filter(|(_, name)| !name.is_empty())
        .map(|(sample, name)| Entry {
            name: name.into(),
            sample,
        })
        .collect()
}

/// A sample for each name of a mark.
fn samples(mark: &Mark) -> Vec<Sample> {
    let sample = match mark {
        Mark::Series { pen, points, .. } if points.iter().any(SeriesPoint::has_band) => {
            Sample::Band(*pen)
        }
        Mark::Line { pen, .. } | Mark::Series { pen, .. } => Sample::Line(*pen),
        Mark::Arrow { pen, .. } => Sample::Arrow(*pen),
        Mark::Points { colour, symbol, .. } => Sample::Point(*colour, *symbol),
        Mark::Area {
            colour, strength, ..
        } => Sample::Area(*colour, *strength),
        Mark::Cells { colours, .. } => return colours.iter().map(cell_sample).collect(),
        Mark::Text { .. } => return Vec::new(),
    };
    vec![sample]
}

fn cell_sample((_, colour): &(String, Colour)) -> Sample {
    Sample::Area(*colour, 1.0)
}

/// Start positions of entries of these widths: side by side, in a new row where the right edge is reached.
fn flow(widths: impl Iterator<Item = f64>, (left, right): (f64, f64), top: f64) -> Vec<(f64, f64)> {
    let (mut x, mut y) = (left, top);
    let mut places = Vec::new();
    for width in widths {
        if x > left && x + width > right {
            (x, y) = (left, y + ROW_HEIGHT);
        }
        places.push((x, y));
        x += width;
    }
    places
}

impl Entry {
    fn width(&self) -> f64 {
        let text = CHARACTER * TEXT_SIZE * self.name.chars().count() as f64;
        SAMPLE_WIDTH + 6.0 + text + SPACE
    }

    fn draw(&self, canvas: &mut Canvas, (left, top): (f64, f64)) {
        let (middle, right) = (top + 8.0, left + SAMPLE_WIDTH);
        self.sample.draw(canvas, (left, right), middle);
        canvas.text(&self.name, (right + 6.0, middle), NAME);
    }
}

impl Sample {
    fn draw(&self, canvas: &mut Canvas, (left, right): (f64, f64), middle: f64) {
        let ends = [(left, middle), (right, middle)];
        let (top, lower_right) = (middle - 6.0, (right, middle + 6.0));
        match *self {
            Sample::Line(pen) => draw_line(canvas, pen, &ends),
            Sample::Band(pen) => {
                let band = rectangle((left, top), lower_right);
                canvas.area(&band, pen.colour.with_opacity(BAND));
                draw_line(canvas, pen, &ends);
            }
            Sample::Arrow(pen) => draw_arrow(canvas, pen, ends[0], ends[1]),
            Sample::Point(colour, symbol) => {
                draw_symbol(canvas, colour, symbol, (right - 8.0, middle));
            }
            Sample::Area(colour, strength) => {
                let outline = rectangle((left + 6.0, top), lower_right);
                draw_box(canvas, outline, colour.with_opacity(strength));
            }
        }
    }
}

/// A filled box with a fine outline.
fn draw_box(canvas: &mut Canvas, mut outline: Points, paint: Paint) {
    canvas.area(&outline, paint);
    outline.push(outline[0]);
    canvas.line(&outline, INK, 0.5);
}

fn draw_line(canvas: &mut Canvas, pen: Pen, ends: &[(f64, f64)]) {
    let width = pen.width.max(1.2);
    for dash in dashes(pen.stroke, ends) {
        canvas.line(&dash, pen.colour, width);
    }
}
