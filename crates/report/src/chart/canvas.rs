//! A page to draw on: a writer of the few elements of SVG that charts consist of.
//!
//! Places and sizes are pixels with fractions. The view box has ten units a pixel, and coordinates are whole units. Each element has a line
//! of its own, and so has the text in a text element.

use super::Points;
use super::colours::{PAPER, Paint, dark_style};
use super::text_style::TextStyle;
use crate::html::escaped;

const UNITS: f64 = 10.0;

/// Shapes on white, in nested groups.
pub(super) struct Canvas {
    /// In units.
    size: (i32, i32),
    elements: String,
}

impl Canvas {
    /// An empty page of `size` pixels.
    pub fn new(size: (f64, f64)) -> Canvas {
        let (width, height) = units(size);
        let elements = format!(
            "<rect x=\"0\" y=\"0\" width=\"{width}\" height=\"{height}\" fill=\"{PAPER}\"/>\n"
        );
        Canvas {
            size: (width, height),
            elements,
        }
    }

    /// Opens a group with attributes, whose values are escaped.
    pub fn open(&mut self, attributes: &str) {
        self.elements += &format!("<g {attributes}>\n");
    }

    /// Closes the group that was opened last.
    pub fn close(&mut self) {
        self.elements += "</g>\n";
    }

    pub fn line(&mut self, points: &[(f64, f64)], paint: impl Into<Paint>, width: f64) {
        let (stroke, points) = (stroke(paint.into(), width), list(points));
        self.elements += &format!("<polyline fill=\"none\" {stroke} points=\"{points}\"/>\n");
    }

    /// A filled polygon.
    pub fn area(&mut self, corners: &[(f64, f64)], paint: impl Into<Paint>) {
        let (fill, corners) = (fill(paint.into()), list(corners));
        self.elements += &format!("<polygon {fill} points=\"{corners}\"/>\n");
    }

    pub fn dot(&mut self, centre: (f64, f64), radius: f64, paint: impl Into<Paint>) {
        let (circle, fill) = (circle(centre, radius), fill(paint.into()));
        self.elements += &format!("<circle {circle} {fill}/>\n");
    }

    pub fn ring(&mut self, centre: (f64, f64), radius: f64, paint: impl Into<Paint>, width: f64) {
        let (circle, stroke) = (circle(centre, radius), stroke(paint.into(), width));
        self.elements += &format!("<circle {circle} fill=\"none\" {stroke}/>\n");
    }

    pub fn text(&mut self, text: &str, place: (f64, f64), style: TextStyle) {
        if text.is_empty() {
            return;
        }
        let ((x, y), size) = (units(place), to_units(style.size));
        let (anchor, dy) = (style.horizontal.anchor(), style.vertical.dy());
        let weight = if style.bold {
            " font-weight=\"bold\""
        } else {
            ""
        };
        let turn = format!(" transform=\"rotate(270, {x}, {y})\"");
        let turn = if style.upward { &turn } else { "" };
        let (fill, text) = (fill(style.colour.into()), escaped(text));
        self.elements += &format!(
            "<text x=\"{x}\" y=\"{y}\" dy=\"{dy}\" text-anchor=\"{anchor}\" font-family=\"sans-serif\" \
             font-size=\"{size}\" {fill}{weight}{turn}>\n{text}\n</text>\n"
        );
    }

    /// The document.
    pub fn into_svg(self) -> String {
        let ((view_width, view_height), style) = (self.size, dark_style());
        let [width, height] = [view_width, view_height].map(|side| f64::from(side) / UNITS);
        let elements = self.elements;
        format!(
            "<svg width=\"{width}\" height=\"{height}\" stroke-linejoin=\"round\" \
             viewBox=\"0 0 {view_width} {view_height}\" xmlns=\"http://www.w3.org/2000/svg\">\n\
             {elements}{style}\n</svg>\n"
        )
    }
}

/// Whole units; 0 for a value that is not a number.
pub(super) fn to_units(pixels: f64) -> i32 {
    (pixels * UNITS).round() as i32
}

fn units((x, y): (f64, f64)) -> (i32, i32) {
    (to_units(x), to_units(y))
}

fn list(points: &[(f64, f64)]) -> String {
    let points = points.iter().map(|point| units(*point));
    let points: Vec<String> = points.map(|(x, y)| format!("{x},{y}")).collect();
    points.join(" ")
}

fn fill(Paint { colour, opacity }: Paint) -> String {
    let opacity = thousandths(opacity);
    format!("opacity=\"{opacity}\" fill=\"{colour}\"")
}

fn stroke(Paint { colour, opacity }: Paint, width: f64) -> String {
    let (opacity, width) = (thousandths(opacity), to_units(width));
    format!("opacity=\"{opacity}\" stroke=\"{colour}\" stroke-width=\"{width}\"")
}

fn circle(centre: (f64, f64), radius: f64) -> String {
    let ((x, y), radius) = (units(centre), to_units(radius));
    format!("cx=\"{x}\" cy=\"{y}\" r=\"{radius}\"")
}

/// A ratio with three decimals at most.
fn thousandths(ratio: f64) -> f64 {
    (ratio * 1000.0).round() / 1000.0
}

/// The corners of a rectangle.
pub(super) fn rectangle((left, top): (f64, f64), (right, bottom): (f64, f64)) -> Points {
    vec![(left, top), (right, top), (right, bottom), (left, bottom)]
}

#[cfg(test)]
mod tests {
    use super::super::colours::{BLUE, VERMILION};
    use super::super::text_style::{Horizontal, Vertical};
    use super::*;

    /// What `draw` adds to an empty page.
    fn drawn(draw: impl FnOnce(&mut Canvas)) -> String {
        let mut canvas = Canvas::new((10.0, 10.0));
        let before = canvas.elements.len();
        draw(&mut canvas);
        canvas.elements[before..].to_owned()
    }

    #[test]
    fn writes_lines_areas_dots_and_rings() {
        let points = [(1.0, 2.0), (3.25, -4.04)];
        assert_eq!(
            drawn(|canvas| canvas.line(&points, BLUE, 1.6)),
            "<polyline fill=\"none\" opacity=\"1\" stroke=\"#0072B2\" stroke-width=\"16\" points=\"10,20 33,-40\"/>\n"
        );
        assert_eq!(
            drawn(|canvas| canvas.area(&points, VERMILION.with_opacity(0.22))),
            "<polygon opacity=\"0.22\" fill=\"#D55E00\" points=\"10,20 33,-40\"/>\n"
        );
        assert_eq!(
            drawn(|canvas| canvas.dot((1.0, 2.0), 3.2, BLUE)),
            "<circle cx=\"10\" cy=\"20\" r=\"32\" opacity=\"1\" fill=\"#0072B2\"/>\n"
        );
        assert_eq!(
            drawn(|canvas| canvas.ring((1.0, 2.0), 4.5, BLUE, 1.6)),
            "<circle cx=\"10\" cy=\"20\" r=\"45\" fill=\"none\" opacity=\"1\" stroke=\"#0072B2\" stroke-width=\"16\"/>\n"
        );
    }

    #[test]
    fn writes_texts_with_anchor_weight_and_rotation_and_escapes_them() {
        let plain = TextStyle::new(12.5, Horizontal::Left, Vertical::Top);
        assert_eq!(
            drawn(|canvas| canvas.text("a<b & \"c\"", (1.0, 2.0), plain.bold())),
            "<text x=\"10\" y=\"20\" dy=\"0.76em\" text-anchor=\"start\" font-family=\"sans-serif\" font-size=\"125\" opacity=\"1\" fill=\"#282828\" font-weight=\"bold\">\na&lt;b &amp; &quot;c&quot;\n</text>\n"
        );
        let turned = TextStyle::new(13.0, Horizontal::Centre, Vertical::Bottom).upward();
        assert_eq!(
            drawn(|canvas| canvas.text("µm", (1.0, 2.0), turned.colour(BLUE))),
            "<text x=\"10\" y=\"20\" dy=\"-0.5ex\" text-anchor=\"middle\" font-family=\"sans-serif\" font-size=\"130\" opacity=\"1\" fill=\"#0072B2\" transform=\"rotate(270, 10, 20)\">\nµm\n</text>\n"
        );
        assert_eq!(drawn(|canvas| canvas.text("", (1.0, 2.0), plain)), "");
    }

    #[test]
    fn writes_whole_units_and_three_decimals_of_an_opacity() {
        for (pixels, units) in [
            (0.04, 0),
            (0.05, 1),
            (-0.06, -1),
            (f64::NAN, 0),
            (f64::INFINITY, i32::MAX),
        ] {
            assert_eq!(to_units(pixels), units, "{pixels}");
        }
        let text = fill(BLUE.with_opacity(0.1 + 0.2));
        assert_eq!(text, "opacity=\"0.3\" fill=\"#0072B2\"");
    }

    #[test]
    fn writes_a_document_of_a_page_and_groups() {
        let mut canvas = Canvas::new((100.0, 60.25));
        canvas.open("class=\"marks\"");
        canvas.close();
        let svg = canvas.into_svg();
        let (before, style) = svg.split_once("<style>").unwrap();
        assert_eq!(
            before,
            "<svg width=\"100\" height=\"60.3\" stroke-linejoin=\"round\" viewBox=\"0 0 1000 603\" xmlns=\"http://www.w3.org/2000/svg\">\n\
             <rect x=\"0\" y=\"0\" width=\"1000\" height=\"603\" fill=\"#FFFFFF\"/>\n\
             <g class=\"marks\">\n</g>\n"
        );
        assert!(style.ends_with("</style>\n</svg>\n"), "{style}");
    }
}
