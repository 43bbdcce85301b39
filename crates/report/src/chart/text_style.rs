//! How and where a text is written.

use super::colours::{Colour, INK};

/// The part of a text that lies at its place, from left to right.
#[derive(Clone, Copy)]
pub(super) enum Horizontal {
    Left,
    Centre,
    Right,
}

impl Horizontal {
    /// The attribute `text-anchor`.
    pub fn anchor(self) -> &'static str {
        match self {
            Horizontal::Left => "start",
            Horizontal::Centre => "middle",
            Horizontal::Right => "end",
        }
    }
}

/// The part of a text that lies at its place, from top to bottom.
#[derive(Clone, Copy)]
pub(super) enum Vertical {
    Top,
    Middle,
    Bottom,
}

impl Vertical {
    /// The attribute `dy`: from the place down to the baseline.
    pub fn dy(self) -> &'static str {
        match self {
            Vertical::Top => "0.76em",
            Vertical::Middle => "0.5ex",
            Vertical::Bottom => "-0.5ex",
        }
    }
}

/// Size, colour and position of a text relative to its place.
#[derive(Clone, Copy)]
pub(super) struct TextStyle {
    pub size: f64,
    pub bold: bool,
    pub colour: Colour,
    pub horizontal: Horizontal,
    pub vertical: Vertical,
    /// Whether it is turned to the left by a quarter.
    pub upward: bool,
}

impl TextStyle {
    pub const fn new(size: f64, horizontal: Horizontal, vertical: Vertical) -> Self {
        Self {
            size,
            bold: false,
            colour: INK,
            horizontal,
            vertical,
            upward: false,
        }
    }

    pub const fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    pub const fn colour(self, colour: Colour) -> Self {
        Self { colour, ..self }
    }

    pub const fn upward(self) -> Self {
        Self {
            upward: true,
            ..self
        }
    }
}
