//! Colours. The named ones are those of Okabe and Ito (2008), which colour-blind readers can tell apart and which differ
//! in lightness in print.

use core::fmt;

/// Red, green and blue, 0 to 255 each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Colour(pub u8, pub u8, pub u8);

/// A colour with an opacity, 0 to 1.
#[derive(Clone, Copy)]
pub(super) struct Paint {
    pub colour: Colour,
    pub opacity: f64,
}

impl Colour {
    pub(super) fn with_opacity(self, opacity: f64) -> Paint {
        Paint {
            colour: self,
            opacity,
        }
    }
}

impl From<Colour> for Paint {
    fn from(colour: Colour) -> Paint {
        colour.with_opacity(1.0)
    }
}

/// The form of SVG, such as `#0072B2`.
impl fmt::Display for Colour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Colour(red, green, blue) = self;
        write!(f, "#{red:02X}{green:02X}{blue:02X}")
    }
}

/// Blue.
pub const BLUE: Colour = Colour(0, 114, 178);
/// Vermilion.
pub const VERMILION: Colour = Colour(213, 94, 0);
/// Bluish green.
pub const GREEN: Colour = Colour(0, 158, 115);
/// Reddish purple.
pub const PURPLE: Colour = Colour(204, 121, 167);
/// Sky blue.
pub const SKY: Colour = Colour(86, 180, 233);
/// Orange.
pub const ORANGE: Colour = Colour(230, 159, 0);
/// Colours of curves of one kind, in their order.
const SERIES: [Colour; 6] = [BLUE, VERMILION, GREEN, ORANGE, PURPLE, SKY];
/// Nearly black, for text and for curves beside coloured ones.
pub const INK: Colour = Colour(40, 40, 40);
/// Grey, for what is shown for comparison only.
pub const GREY: Colour = Colour(140, 140, 140);
/// The background.
pub const PAPER: Colour = Colour(255, 255, 255);

/// Areas without a mark, such as the cells of a map in which there is nothing.
pub const UNMARKED: Colour = FINE_GRID;

/// Text of secondary importance.
pub(super) const SECONDARY_INK: Colour = Colour(95, 95, 95);
/// The frame of a chart.
pub(super) const FRAME: Colour = Colour(90, 90, 90);
/// Grid lines with a number.
pub(super) const GRID: Colour = Colour(205, 205, 205);
/// Grid lines without a number.
pub(super) const FINE_GRID: Colour = Colour(234, 234, 234);

/// Colours in a dark viewer, by the colours on white.
const DARK: [(Colour, Colour); 9] = [
    (PAPER, Colour(22, 24, 27)),
    (INK, Colour(230, 230, 230)),
    (SECONDARY_INK, Colour(168, 168, 168)),
    (FRAME, Colour(150, 156, 164)),
    (GRID, Colour(62, 67, 74)),
    (FINE_GRID, Colour(38, 42, 47)),
    (BLUE, Colour(79, 168, 220)),
    (VERMILION, Colour(255, 138, 60)),
    (SKY, Colour(190, 228, 255)),
];

/// The colour of the curve with this index among curves of one kind.
pub(crate) fn series_colour(index: usize) -> Colour {
    SERIES[index % SERIES.len()]
}

/// Whether curves with lower indices have used each colour.
pub(super) fn is_colour_repeated(index: usize) -> bool {
    index >= SERIES.len()
}

/// A style element that changes the colours of the picture where the viewer prefers dark mode.
pub(crate) fn dark_style() -> String {
    let rules: String = DARK.iter().map(dark_rule).collect();
    format!("<style>@media screen and (prefers-color-scheme:dark){{{rules}}}</style>")
}

fn dark_rule((light, dark): &(Colour, Colour)) -> String {
    format!("svg [fill=\"{light}\"]{{fill:{dark}}}svg [stroke=\"{light}\"]{{stroke:{dark}}}")
}
