//! The marks of a chart.

use super::colours::{Colour, is_colour_repeated, series_colour};

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pen {
    /// Colour.
    pub colour: Colour,
    /// Dash pattern.
    pub stroke: Stroke,
    /// Width in pixels.
    pub width: f64,
}

/// Dash pattern of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stroke {
    /// Continuous.
    Solid,
    /// Long dashes.
    Dashed,
    /// Short dashes.
    Dotted,
}

impl Pen {
    const fn new(colour: Colour, stroke: Stroke) -> Pen {
        Pen {
            colour,
            stroke,
            width: 1.6,
        }
    }

    /// A continuous line.
    pub const fn solid(colour: Colour) -> Pen {
        Pen::new(colour, Stroke::Solid)
    }

    /// A dashed line.
    pub const fn dashed(colour: Colour) -> Pen {
        Pen::new(colour, Stroke::Dashed)
    }

    /// The line of the curve with this index among curves of one kind: dashed where its colour is repeated.
    pub(crate) fn of_series(index: usize) -> Pen {
        let colour = series_colour(index);
        if !is_colour_repeated(index) {
            Pen::solid(colour)
        } else {
            Pen::dashed(colour)
        }
    }

    /// A dotted line.
    pub const fn dotted(colour: Colour) -> Pen {
        Pen::new(colour, Stroke::Dotted)
    }

    /// The same pen with half the width.
    pub const fn thin(self) -> Pen {
        self.width(0.5 * self.width)
    }

    /// The same pen with another width in pixels.
    pub const fn width(self, width: f64) -> Pen {
        Pen { width, ..self }
    }
}

/// Symbol at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symbol {
    /// x, for poles.
    Cross,
    /// o, for zeros.
    Ring,
    /// A filled dot.
    Dot,
}

/// One point of a series with an uncertainty band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeriesPoint {
    /// Horizontal value.
    pub x: f64,
    /// Vertical value.
    pub y: f64,
    /// Lower and upper end of the band; both equal to `y` without one.
    pub band: (f64, f64),
    /// Whether the value is too uncertain for a full line; it is drawn faint.
    pub faint: bool,
    /// Whether a gap precedes this point.
    pub starts: bool,
}

impl SeriesPoint {
    /// Whether the band has a width.
    pub(super) fn has_band(&self) -> bool {
        self.band.0 < self.band.1
    }
}

/// One mark of a chart. Marks with an empty name have no entry in the legend.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// A line; a point that is not finite is a gap.
    Line {
        /// Name in the legend.
        name: String,
        /// How it is drawn.
        pen: Pen,
        /// Its points.
        points: Vec<(f64, f64)>,
        /// Whether arrow heads show its direction.
        directed: bool,
    },
    /// A curve of rising x with an uncertainty band and gaps.
    Series {
        /// Name in the legend.
        name: String,
        /// How it is drawn.
        pen: Pen,
        /// Its points.
        points: Vec<SeriesPoint>,
        /// Whether points are marked by dots where they are few.
        dots: bool,
    },
    /// An arrow.
    Arrow {
        /// Name in the legend.
        name: String,
        /// How its shaft is drawn.
        pen: Pen,
        /// Start.
        from: (f64, f64),
        /// Tip.
        to: (f64, f64),
    },
    /// Points.
    Points {
        /// Name in the legend.
        name: String,
        /// Their colour.
        colour: Colour,
        /// Their symbol.
        symbol: Symbol,
        /// Their places.
        points: Vec<(f64, f64)>,
    },
    /// A filled area.
    Area {
        /// Name in the legend.
        name: String,
        /// Its colour.
        colour: Colour,
        /// Its opacity, 0 to 1.
        strength: f64,
        /// Its corners.
        outline: Vec<(f64, f64)>,
    },
    /// A map: the cell between `x[i]`, `x[i+1]` and `y[j]`, `y[j+1]` has the colour `colours[rows[j][i]]`.
    Cells {
        /// Rising edges.
        x: Vec<f64>,
        /// Rising edges.
        y: Vec<f64>,
        /// Indices of the colours, by row.
        rows: Vec<Vec<usize>>,
        /// Names for the legend, and colours.
        colours: Vec<(String, Colour)>,
    },
    /// Text beside a point.
    Text {
        /// The point.
        at: (f64, f64),
        /// Pixels from the point to the anchor of the text, to the right and down.
        offset: (f64, f64),
        /// The part of the text that is placed there.
        anchor: Anchor,
        /// The text.
        text: String,
        /// Its colour.
        colour: Colour,
    },
}

/// The part of a text whose place is given; vertically it is always the middle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    /// Its left end.
    Start,
    /// Its middle.
    Middle,
}

impl Mark {
    /// Whether the mark covers what is below it.
    pub(super) fn is_area(&self) -> bool {
        matches!(self, Mark::Cells { .. } | Mark::Area { .. })
    }

    /// Names for the legend; some may be empty.
    pub(super) fn names(&self) -> Vec<&str> {
        match self {
            Mark::Line { name, .. }
            | Mark::Series { name, .. }
            | Mark::Arrow { name, .. }
            | Mark::Points { name, .. }
            | Mark::Area { name, .. } => vec![name],
            Mark::Cells { colours, .. } => colours.iter().map(|(name, _)| name.as_str()).collect(),
            Mark::Text { .. } => Vec::new(),
        }
    }

    /// The points that the axes have to cover.
    pub(super) fn extent(&self) -> Vec<(f64, f64)> {
        match self {
            Mark::Line { points, .. } | Mark::Points { points, .. } => points.clone(),
            Mark::Series { points, .. } => points.iter().map(|point| (point.x, point.y)).collect(),
            Mark::Arrow { from, to, .. } => vec![*from, *to],
            Mark::Area { outline, .. } => outline.clone(),
            Mark::Cells { x, y, .. } => corners(x, y),
            Mark::Text { at, .. } => vec![*at],
        }
    }
}

/// Lower left and upper right corner of a map.
fn corners(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    let first = x.first().zip(y.first());
    let last = x.last().zip(y.last());
    let corners = first.into_iter().chain(last);
    corners.map(|(x, y)| (*x, *y)).collect()
}
