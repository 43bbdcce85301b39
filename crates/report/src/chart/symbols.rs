//! Strokes, arrows and symbols.

use super::Points;
use super::canvas::Canvas;
use super::colours::Colour;
use super::mark::{Pen, Symbol};
use super::series::dashes;

/// Radius of a symbol.
const SYMBOL: f64 = 4.5;
/// Pixels between the arrow heads of a directed line, and their length.
const ARROW_SPACING: f64 = 170.0;
const ARROW_LENGTH: f64 = 7.0;

/// A line in the dashes of a pen.
pub(super) fn draw_stroke(canvas: &mut Canvas, pen: Pen, opacity: f64, points: &[(f64, f64)]) {
    for dash in dashes(pen.stroke, points) {
        canvas.line(&dash, pen.colour.with_opacity(opacity), pen.width);
    }
}

/// A line with a head; a dot where it is shorter than its head.
pub(super) fn draw_arrow(canvas: &mut Canvas, pen: Pen, from: (f64, f64), to: (f64, f64)) {
    draw_stroke(canvas, pen, 1.0, &[from, to]);
    let length = 5.0 + 1.5 * pen.width;
    match arrow_head(from, to, length, 0.4) {
        Some(head) => canvas.area(&head, pen.colour),
        None => canvas.dot(to, pen.width, pen.colour),
    }
}

/// A triangle with its tip at the end of a segment; `slope` is half its width over its length.
fn arrow_head(from: (f64, f64), to: (f64, f64), length: f64, slope: f64) -> Option<Points> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let distance = libm::hypot(dx, dy);
    if !distance.is_finite() || distance < length {
        return None;
    }
    let (ux, uy) = (length * dx / distance, length * dy / distance);
    let corner = |side: f64| (to.0 - ux - side * slope * uy, to.1 - uy + side * slope * ux);
    Some(vec![to, corner(1.0), corner(-1.0)])
}

/// Arrow heads along a line.
pub(super) fn arrow_heads(points: &[(f64, f64)]) -> Vec<Points> {
    let (mut since_last, mut heads) = (0.55 * ARROW_SPACING, Vec::new());
    for pair in points.windows(2) {
        let length = libm::hypot(pair[1].0 - pair[0].0, pair[1].1 - pair[0].1);
        since_last += length;
        if since_last > ARROW_SPACING && length > 0.0 {
            heads.extend(middle_arrow_head(pair[0], pair[1], length));
            since_last = 0.0;
        }
    }
    heads
}

/// An arrow head in the middle of a segment of given length.
fn middle_arrow_head(from: (f64, f64), to: (f64, f64), length: f64) -> Option<Points> {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (ux, uy) = (dx / length * ARROW_LENGTH, dy / length * ARROW_LENGTH);
    let middle = (from.0 + 0.5 * dx, from.1 + 0.5 * dy);
    let start = (middle.0 - ux, middle.1 - uy);
    let tip = (middle.0 + 0.5 * ux, middle.1 + 0.5 * uy);
    arrow_head(start, tip, ARROW_LENGTH, 0.5)
}

pub(super) fn draw_symbol(canvas: &mut Canvas, colour: Colour, symbol: Symbol, (x, y): (f64, f64)) {
    match symbol {
        Symbol::Dot => canvas.dot((x, y), 3.2, colour),
        Symbol::Ring => canvas.ring((x, y), SYMBOL, colour, 1.6),
        Symbol::Cross => {
            let (left, right, top, bottom) = (x - SYMBOL, x + SYMBOL, y - SYMBOL, y + SYMBOL);
            canvas.line(&[(left, top), (right, bottom)], colour, 1.8);
            canvas.line(&[(left, bottom), (right, top)], colour, 1.8);
        }
    }
}
