//! A page to draw on, in pixels with fractions.
//!
//! plotters rounds to whole units; a page ten times as large, shown at a tenth, rounds to tenths of a pixel.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::Points;
use super::colours::{Colour, INK, PAPER, dark_style};
use crate::ReportError;

const UNITS: f64 = 10.0;
/// plotters divides by this before it writes a font size.
const FONT_SCALE: f64 = 1.24;

/// A drawing of given size.
pub(super) struct Canvas<'a>(DrawingArea<SVGBackend<'a>, Shift>);

/// Size, colour and position of a text relative to its anchor point.
#[derive(Clone, Copy)]
pub(super) struct TextStyle {
    pub size: f64,
    pub colour: Colour,
    pub bold: bool,
    anchor: (HPos, VPos),
    upward: bool,
}

impl TextStyle {
    pub const fn new(size: f64, horizontal: HPos, vertical: VPos) -> Self {
        Self {
            size,
            colour: INK,
            bold: false,
            anchor: (horizontal, vertical),
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

/// An SVG document: shapes on white, in nested groups.
pub(super) struct Page {
    /// In pixels.
    size: (f64, f64),
    elements: String,
}

impl Page {
    /// An empty page of `size` pixels.
    pub fn new(size: (f64, f64)) -> Result<Page, ReportError> {
        let elements = String::new();
        let mut page = Page { size, elements };
        page.draw(|canvas| canvas.0.fill(&PAPER).map_err(failed))?;
        Ok(page)
    }

    /// Appends what `draw` draws.
    pub fn draw(
        &mut self,
        draw: impl FnOnce(&Canvas) -> Result<(), ReportError>,
    ) -> Result<(), ReportError> {
        let mut svg = String::new();
        {
            let backend = SVGBackend::with_string(&mut svg, self.size_in_drawing_units());
            let canvas = Canvas(backend.into_drawing_area());
            draw(&canvas)?;
            canvas.0.present().map_err(failed)?;
        }
        let inside = svg
            .split_once('\n')
            .and_then(|(_, rest)| rest.rsplit_once("</svg>"));
        self.elements += inside.map_or("", |(elements, _)| elements);
        Ok(())
    }

    /// Opens a group with attributes.
    pub fn open(&mut self, attributes: &str) {
        self.elements += &format!("<g {attributes}>\n");
    }

    /// Closes the group that was opened last.
    pub fn close(&mut self) {
        self.elements += "</g>\n";
    }

    /// The document.
    pub fn into_svg(self) -> String {
        let ((width, height), style) = (self.size, dark_style());
        let (view_width, view_height) = self.size_in_drawing_units();
        let elements = self.elements;
        format!(
            "<svg width=\"{width}\" height=\"{height}\" stroke-linejoin=\"round\" \
             viewBox=\"0 0 {view_width} {view_height}\" xmlns=\"http://www.w3.org/2000/svg\">\n\
             {elements}{style}\n</svg>\n"
        )
    }

    fn size_in_drawing_units(&self) -> (u32, u32) {
        let (width, height) = self.size;
        (
            to_drawing_units(width) as u32,
            to_drawing_units(height) as u32,
        )
    }
}

impl Canvas<'_> {
    pub fn line(
        &self,
        points: &[(f64, f64)],
        colour: RGBAColor,
        width: f64,
    ) -> Result<(), ReportError> {
        let style = colour.stroke_width(to_drawing_units(width) as u32);
        let path = PathElement::new(points_in_drawing_units(points), style);
        self.0.draw(&path).map_err(failed)
    }

    pub fn area(&self, points: &[(f64, f64)], colour: RGBAColor) -> Result<(), ReportError> {
        let polygon = Polygon::new(points_in_drawing_units(points), colour.filled());
        self.0.draw(&polygon).map_err(failed)
    }

    pub fn dot(
        &self,
        centre: (f64, f64),
        radius: f64,
        colour: RGBAColor,
    ) -> Result<(), ReportError> {
        let circle = Circle::new(at(centre), to_drawing_units(radius), colour.filled());
        self.0.draw(&circle).map_err(failed)
    }

    pub fn ring(
        &self,
        centre: (f64, f64),
        radius: f64,
        colour: Colour,
        width: f64,
    ) -> Result<(), ReportError> {
        let style = colour.stroke_width(to_drawing_units(width) as u32);
        let circle = Circle::new(at(centre), to_drawing_units(radius), style);
        self.0.draw(&circle).map_err(failed)
    }

    pub fn text(
        &self,
        text: &str,
        position: (f64, f64),
        style: TextStyle,
    ) -> Result<(), ReportError> {
        if text.is_empty() {
            return Ok(());
        }
        let weight = if style.bold {
            FontStyle::Bold
        } else {
            FontStyle::Normal
        };
        let turn = if style.upward {
            FontTransform::Rotate270
        } else {
            FontTransform::None
        };
        let size = style.size * UNITS * FONT_SCALE;
        let font = FontDesc::new(FontFamily::SansSerif, size, weight).transform(turn);
        let anchor = Pos::new(style.anchor.0, style.anchor.1);
        let text = Text::new(text, at(position), font.color(&style.colour).pos(anchor));
        self.0.draw(&text).map_err(failed)
    }
}

pub(super) fn to_drawing_units(pixels: f64) -> i32 {
    (pixels * UNITS).round() as i32
}

fn at((x, y): (f64, f64)) -> (i32, i32) {
    (to_drawing_units(x), to_drawing_units(y))
}

fn points_in_drawing_units(points: &[(f64, f64)]) -> Vec<(i32, i32)> {
    points.iter().map(|point| at(*point)).collect()
}

fn failed(error: impl core::fmt::Display) -> ReportError {
    ReportError::Drawing(error.to_string())
}

/// The corners of a rectangle.
pub(super) fn rectangle((left, top): (f64, f64), (right, bottom): (f64, f64)) -> Points {
    vec![(left, top), (right, top), (right, bottom), (left, bottom)]
}
