//! The scale of an axis.

/// One axis: label, spacing and range.
#[derive(Clone, Debug, PartialEq)]
pub struct Scale {
    /// Quantity and unit.
    pub label: String,
    /// Spacing and ticks.
    pub kind: ScaleKind,
    /// Ends of the axis; without them the axis covers the marks with a margin.
    pub range: Option<(f64, f64)>,
    /// Whether label and tick numbers are written.
    pub numbered: bool,
}

/// Spacing and ticks of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ScaleKind {
    /// Linear.
    Linear,
    /// Logarithmic; shows values above 0 only.
    Logarithmic,
    /// Linear, with ticks at multiples of 30 or 90 degrees.
    Degrees,
    /// Linear, with ticks at whole numbers.
    Count,
    /// Linear, without ticks: for schematic drawings.
    Blank,
}

impl Scale {
    fn new(label: &str, kind: ScaleKind) -> Scale {
        Scale {
            label: label.into(),
            kind,
            range: None,
            numbered: true,
        }
    }

    /// A linear axis.
    pub fn linear(label: &str) -> Scale {
        Scale::new(label, ScaleKind::Linear)
    }

    /// A logarithmic axis.
    pub fn logarithmic(label: &str) -> Scale {
        Scale::new(label, ScaleKind::Logarithmic)
    }

    /// A logarithmic axis of frequencies in hertz, with these ends if the lower one is below the upper one.
    pub fn frequency((low_hz, high_hz): (f64, f64)) -> Scale {
        let scale = Scale::logarithmic("Frequency (Hz)");
        if low_hz < high_hz {
            scale.within(low_hz, high_hz)
        } else {
            scale
        }
    }

    /// A linear axis in degrees.
    pub fn degrees(label: &str) -> Scale {
        Scale::new(label, ScaleKind::Degrees)
    }

    /// A linear axis of a number of things.
    pub fn count(label: &str) -> Scale {
        Scale::new(label, ScaleKind::Count)
    }

    /// A linear axis without ticks.
    pub fn blank(label: &str) -> Scale {
        Scale::new(label, ScaleKind::Blank)
    }

    /// Sets the ends of the axis.
    pub fn within(self, low: f64, high: f64) -> Scale {
        Scale {
            range: Some((low, high)),
            ..self
        }
    }

    /// Hides label and numbers: the chart below has the same axis.
    pub fn unnumbered(self) -> Scale {
        Scale {
            numbered: false,
            ..self
        }
    }
}
