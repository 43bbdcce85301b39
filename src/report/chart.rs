//! A chart: axes and what is drawn between them, in values; [`super::sheet_svg`] makes the picture.

use super::colours::{Colour, INK};

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pen {
    /// Its colour.
    pub colour: Colour,
    /// Dashes.
    pub stroke: Stroke,
    /// Its width in pixels.
    pub width: f64,
}

/// Dashes of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stroke {
    /// None.
    Solid,
    /// Long ones.
    Dashed,
    /// Short ones.
    Dotted,
}

impl Pen {
    /// A whole line.
    pub const fn solid(colour: Colour) -> Pen {
        Pen {
            colour,
            stroke: Stroke::Solid,
            width: 1.6,
        }
    }

    /// A line in dashes.
    pub const fn dashed(colour: Colour) -> Pen {
        Pen {
            stroke: Stroke::Dashed,
            ..Pen::solid(colour)
        }
    }

    /// A line in dots.
    pub const fn dotted(colour: Colour) -> Pen {
        Pen {
            stroke: Stroke::Dotted,
            ..Pen::solid(colour)
        }
    }

    /// The same, half as wide.
    pub const fn thin(self) -> Pen {
        Pen {
            width: 0.5 * self.width,
            ..self
        }
    }
}

/// What marks a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Symbol {
    /// x, as poles are drawn.
    Cross,
    /// o, as zeros are drawn.
    Ring,
    /// A filled dot.
    Dot,
}

/// One axis: what is along it, and how far it goes.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// Quantity and unit.
    pub label: String,
    /// Its spacing.
    pub kind: ScaleKind,
    /// Its ends; those of what is drawn, with a margin, where there are none.
    pub range: Option<(f64, f64)>,
}

/// Spacing and ticks of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScaleKind {
    /// Even.
    Linear,
    /// By powers of ten, values above 0 only.
    Logarithmic,
    /// Even, with ticks at quarters of a turn in degrees.
    Degrees,
    /// Even, without numbers: a drawing.
    Blank,
}

impl Scale {
    /// Even, with a quantity and its unit.
    pub fn linear(label: &str) -> Scale {
        Scale {
            label: label.into(),
            kind: ScaleKind::Linear,
            range: None,
        }
    }

    /// By powers of ten.
    pub fn logarithmic(label: &str) -> Scale {
        Scale {
            kind: ScaleKind::Logarithmic,
            ..Scale::linear(label)
        }
    }

    /// Degrees.
    pub fn degrees(label: &str) -> Scale {
        Scale {
            kind: ScaleKind::Degrees,
            ..Scale::linear(label)
        }
    }

    /// Without numbers.
    pub fn blank(label: &str) -> Scale {
        Scale {
            kind: ScaleKind::Blank,
            ..Scale::linear(label)
        }
    }

    /// With these ends.
    pub fn within(self, low: f64, high: f64) -> Scale {
        Scale {
            range: Some((low, high)),
            ..self
        }
    }
}

/// One thing that is drawn.
#[derive(Clone, Debug, PartialEq)]
pub enum Mark {
    /// A line through points; a point that is not a number is a gap.
    Line {
        /// In the legend, if it has a name.
        name: String,
        /// How.
        pen: Pen,
        /// Through where.
        points: Vec<(f64, f64)>,
        /// Whether arrow heads along it show its direction.
        directed: bool,
    },
    /// Points.
    Points {
        /// In the legend, if they have a name.
        name: String,
        /// Their colour.
        colour: Colour,
        /// Their shape.
        symbol: Symbol,
        /// Where.
        points: Vec<(f64, f64)>,
    },
    /// A filled area.
    Area {
        /// In the legend, if it has a name.
        name: String,
        /// Its colour.
        colour: Colour,
        /// How much of it covers what is below, 0 to 1.
        strength: f64,
        /// Its corners.
        outline: Vec<(f64, f64)>,
    },
    /// A map: the cell between `x[i]`, `x[i+1]` and `y[j]`, `y[j+1]` has the colour `colours[rows[j][i]]`.
    Cells {
        /// Edges, rising.
        x: Vec<f64>,
        /// Edges, rising.
        y: Vec<f64>,
        /// Colours by row.
        rows: Vec<Vec<usize>>,
        /// Names, for the legend, and colours.
        colours: Vec<(String, Colour)>,
    },
    /// Words, beside a point.
    Text {
        /// Where.
        at: (f64, f64),
        /// Pixels to the right and down from there to the middle of the words.
        offset: (f64, f64),
        /// What.
        text: String,
        /// In which colour.
        colour: Colour,
    },
}

/// Axes and what is drawn between them.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    /// What stands above it.
    pub heading: String,
    /// To the right.
    pub x: Scale,
    /// Upwards.
    pub y: Scale,
    /// First what is drawn first.
    pub marks: Vec<Mark>,
    /// Whether both axes have as many pixels a unit.
    pub equal: bool,
}

impl Chart {
    /// A chart without anything in it.
    pub fn new(heading: &str, x: Scale, y: Scale) -> Chart {
        Chart {
            heading: heading.into(),
            x,
            y,
            marks: Vec::new(),
            equal: false,
        }
    }

    /// With as many pixels a unit on both axes: a circle is round.
    pub fn equal(self) -> Chart {
        Chart {
            equal: true,
            ..self
        }
    }

    /// With one thing more.
    pub fn mark(mut self, mark: Mark) -> Chart {
        self.marks.push(mark);
        self
    }

    /// With a line.
    pub fn line(self, name: &str, pen: Pen, points: Vec<(f64, f64)>) -> Chart {
        self.mark(Mark::Line {
            name: name.into(),
            pen,
            points,
            directed: false,
        })
    }

    /// With a line whose direction arrow heads show.
    pub fn directed(self, name: &str, pen: Pen, points: Vec<(f64, f64)>) -> Chart {
        self.mark(Mark::Line {
            name: name.into(),
            pen,
            points,
            directed: true,
        })
    }

    /// With points.
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

    /// With words centred beside a point: so many pixels to the right and down.
    pub fn text(self, at: (f64, f64), offset: (f64, f64), text: &str) -> Chart {
        self.mark(Mark::Text {
            at,
            offset,
            text: text.into(),
            colour: INK,
        })
    }
}
