//! A page to draw on, in pixels with fractions.
//!
//! plotters rounds to whole units; a page ten times as large, shown at a tenth, rounds to tenths of a pixel.

use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::ReportError;
use super::colours::PAPER;

const UNITS: f64 = 10.0;
/// plotters divides by this before it writes a font size.
const FONT_SCALE: f64 = 1.24;

/// A drawing of given size.
pub(super) struct Canvas<'a>(DrawingArea<SVGBackend<'a>, Shift>);

/// How text stands.
#[derive(Clone, Copy)]
pub(super) struct TextForm {
    pub size: f64,
    pub colour: RGBColor,
    pub bold: bool,
    pub anchor: (HPos, VPos),
    pub upward: bool,
}

/// Draws a page of `size` pixels, on white, and gives it as SVG.
pub(super) fn page(
    size: (f64, f64),
    draw: impl FnOnce(&Canvas) -> Result<(), ReportError>,
) -> Result<String, ReportError> {
    let (width, height) = (units(size.0) as u32, units(size.1) as u32);
    let mut svg = String::new();
    {
        let canvas = Canvas(SVGBackend::with_string(&mut svg, (width, height)).into_drawing_area());
        // On a dark ground, as some viewers have, dark ink would not be seen.
        canvas.0.fill(&PAPER).map_err(failed)?;
        draw(&canvas)?;
        canvas.0.present().map_err(failed)?;
    }
    let from = format!("<svg width=\"{width}\" height=\"{height}\"");
    let to = format!(
        "<svg width=\"{}\" height=\"{}\" stroke-linejoin=\"round\"",
        size.0, size.1
    );
    Ok(svg.replacen(&from, &to, 1))
}

impl Canvas<'_> {
    pub fn line(
        &self,
        points: &[(f64, f64)],
        colour: RGBAColor,
        width: f64,
    ) -> Result<(), ReportError> {
        let points: Vec<_> = points.iter().map(|point| at(*point)).collect();
        self.0
            .draw(&PathElement::new(
                points,
                colour.stroke_width(units(width) as u32),
            ))
            .map_err(failed)
    }

    pub fn area(&self, points: &[(f64, f64)], colour: RGBAColor) -> Result<(), ReportError> {
        let points: Vec<_> = points.iter().map(|point| at(*point)).collect();
        self.0
            .draw(&Polygon::new(points, colour.filled()))
            .map_err(failed)
    }

    pub fn dot(
        &self,
        centre: (f64, f64),
        radius: f64,
        colour: RGBAColor,
    ) -> Result<(), ReportError> {
        self.0
            .draw(&Circle::new(at(centre), units(radius), colour.filled()))
            .map_err(failed)
    }

    pub fn ring(
        &self,
        centre: (f64, f64),
        radius: f64,
        colour: RGBAColor,
        width: f64,
    ) -> Result<(), ReportError> {
        let style = colour.stroke_width(units(width) as u32);
        self.0
            .draw(&Circle::new(at(centre), units(radius), style))
            .map_err(failed)
    }

    pub fn text(
        &self,
        text: &str,
        position: (f64, f64),
        form: TextForm,
    ) -> Result<(), ReportError> {
        let style = if form.bold {
            FontStyle::Bold
        } else {
            FontStyle::Normal
        };
        let turn = if form.upward {
            FontTransform::Rotate270
        } else {
            FontTransform::None
        };
        let font = FontDesc::new(FontFamily::SansSerif, form.size * UNITS * FONT_SCALE, style)
            .transform(turn);
        let style = font
            .color(&form.colour)
            .pos(Pos::new(form.anchor.0, form.anchor.1));
        self.0
            .draw(&Text::new(text, at(position), style))
            .map_err(failed)
    }
}

fn units(pixels: f64) -> i32 {
    (pixels * UNITS).round() as i32
}

fn at((x, y): (f64, f64)) -> (i32, i32) {
    (units(x), units(y))
}

fn failed(error: impl core::fmt::Display) -> ReportError {
    ReportError::Drawing(error.to_string())
}
