//! Okabe and Ito's colours, which the colour-blind can tell apart, and which differ in lightness in print.

/// A colour by its red, green and blue parts.
pub use plotters::style::RGBColor as Colour;

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
/// Nearly black: text, and what stands beside colours.
pub const INK: Colour = Colour(40, 40, 40);
/// Grey: what is only there to compare with.
pub const GREY: Colour = Colour(140, 140, 140);
/// The page.
pub const PAPER: Colour = Colour(255, 255, 255);
