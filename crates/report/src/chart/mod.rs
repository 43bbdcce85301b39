//! The chart engine: charts are described in values and drawn as self-contained SVG.
//!
//! ```text
//! Chart (Scale, Mark) -> sheet (rows, header, legend) -> plot_area (axes, marks) -> canvas (SVG)
//!                                                         attributes: scales and names for plot.js
//!                                                         symbols: points and arrow heads
//!                                                         text_style: size, anchor and direction of texts
//!                                                         axis: value to pixel, ticks
//!                                                         frame, series: clipped and thinned to what a screen shows
//! ```
//!
//! Text stays text in the SVG, in the viewer's own sans-serif font. Colours follow the viewer's light or dark mode.

mod attributes;
mod axis;
mod canvas;
pub mod colours;
mod frame;
mod header;
mod legend;
mod mark;
mod plot_area;
mod scale;
mod series;
mod sheet;
mod symbols;
mod text_style;

pub use mark::{Anchor, Mark, Pen, SeriesPoint, Stroke, Symbol};
pub use scale::{Scale, ScaleKind};
pub use sheet::{Row, sheet_svg};

pub(super) use colours::dark_style;
use colours::{Colour, INK};

/// Points (x, y), in values of the axes or in pixels.
type Points = Vec<(f64, f64)>;

/// Two axes and the marks between them.
///
/// ```
/// use bench_report::{Chart, Pen, Row, Scale, colours, sheet_svg};
///
/// let chart = Chart::new("Step response", Scale::linear("Time (s)"), Scale::linear("Position (µm)"))
///     .line("measured", Pen::solid(colours::BLUE), vec![(0.0, 0.0), (0.1, 48.0), (0.2, 50.0)]);
/// let svg = sheet_svg("Stage", "profile stage", &[Row::new(300.0, vec![chart])])?;
/// assert!(svg.starts_with("<svg"));
/// # Ok::<(), bench_report::ReportError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// Heading above the chart.
    pub heading: String,
    /// Horizontal axis.
    pub x: Scale,
    /// Vertical axis.
    pub y: Scale,
    /// Marks in drawing order.
    pub marks: Vec<Mark>,
    /// Whether both axes have the same number of pixels per unit.
    pub equal: bool,
    /// Whether named marks have an entry in the legend.
    pub legend: bool,
}

impl Chart {
    /// A chart without marks.
    pub fn new(heading: &str, x: Scale, y: Scale) -> Chart {
        Chart {
            heading: heading.into(),
            x,
            y,
            marks: Vec::new(),
            equal: false,
            legend: true,
        }
    }

    /// Gives both axes the same number of pixels per unit, so that a circle is round.
    pub fn equal(self) -> Chart {
        Chart {
            equal: true,
            ..self
        }
    }

    /// Leaves out the legend: another chart of the sheet has it.
    pub fn without_legend(self) -> Chart {
        Chart {
            legend: false,
            ..self
        }
    }

    /// Adds a mark.
    pub fn mark(mut self, mark: Mark) -> Chart {
        self.marks.push(mark);
        self
    }

    /// Adds a line. Marks with an empty name have no entry in the legend.
    pub fn line(self, name: &str, pen: Pen, points: Vec<(f64, f64)>) -> Chart {
        self.mark(Mark::Line {
            name: name.into(),
            pen,
            points,
            directed: false,
        })
    }

    /// Adds a line with arrow heads that show its direction.
    pub fn directed(self, name: &str, pen: Pen, points: Vec<(f64, f64)>) -> Chart {
        self.mark(Mark::Line {
            name: name.into(),
            pen,
            points,
            directed: true,
        })
    }

    /// Adds an arrow from one point to another.
    pub fn arrow(self, name: &str, pen: Pen, from: (f64, f64), to: (f64, f64)) -> Chart {
        self.mark(Mark::Arrow {
            name: name.into(),
            pen,
            from,
            to,
        })
    }

    /// Adds points.
    pub fn points(
        self,
        name: &str,
        colour: Colour,
        symbol: Symbol,
        points: Vec<(f64, f64)>,
    ) -> Chart {
        self.mark(Mark::Points {
            name: name.into(),
            colour,
            symbol,
            points,
        })
    }

    /// Adds a filled area. `strength` is its opacity, 0 to 1.
    pub fn area(
        self,
        name: &str,
        colour: Colour,
        strength: f64,
        outline: Vec<(f64, f64)>,
    ) -> Chart {
        self.mark(Mark::Area {
            name: name.into(),
            colour,
            strength,
            outline,
        })
    }

    /// Adds text, centred `offset` pixels to the right of and below a point.
    pub fn text(self, at: (f64, f64), offset: (f64, f64), text: &str) -> Chart {
        self.anchored_text(at, offset, Anchor::Middle, text)
    }

    /// Adds text that begins `offset` pixels to the right of and below a point.
    pub fn text_from(self, at: (f64, f64), offset: (f64, f64), text: &str) -> Chart {
        self.anchored_text(at, offset, Anchor::Start, text)
    }

    fn anchored_text(
        self,
        at: (f64, f64),
        offset: (f64, f64),
        anchor: Anchor,
        text: &str,
    ) -> Chart {
        self.mark(Mark::Text {
            at,
            offset,
            anchor,
            text: text.into(),
            colour: INK,
        })
    }
}
