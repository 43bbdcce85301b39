//! What stands above the panels: title, subtitle and legend, wrapped so that nothing is cut off.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, VPos};

use super::ReportError;
use super::canvas::{Canvas, TextForm};
use super::panel::{self, BAND, INK, LINE_WIDTH};
use super::trace::Line;

const QUIET_INK: RGBColor = RGBColor(95, 95, 95);
const TITLE_SIZE: f64 = 17.0;
pub(super) const TEXT_SIZE: f64 = 12.5;
/// A character is so wide on average at most, in parts of the font's size, in any usual sans-serif: normal, and bold.
pub(super) const CHARACTER: f64 = 0.58;
const BOLD_CHARACTER: f64 = 0.68;
const SWATCH: f64 = 30.0;

/// Title, subtitle and legend, laid out over the width between two edges.
pub(super) struct Header {
    texts: Vec<(String, f64, bool)>,
    /// For each line of a plot, where its entry begins.
    entries: Vec<(f64, f64)>,
    left: f64,
    /// Where the panels may begin.
    pub bottom: f64,
}

impl Header {
    pub fn new(title: &str, subtitle: &str, lines: &[Line], (left, right): (f64, f64)) -> Self {
        let mut y = 14.0;
        let mut texts = Vec::new();
        for (text, size, bold) in [(title, TITLE_SIZE, true), (subtitle, TEXT_SIZE, false)] {
            let character = size * if bold { BOLD_CHARACTER } else { CHARACTER };
            for row in wrapped(text, ((right - left) / character) as usize) {
                texts.push((row, y, bold));
                y += 1.4 * size;
            }
        }
        let entries = entries(lines, (left, right), y + 4.0);
        let bottom = entries.last().map_or(y, |entry| entry.1) + 26.0;
        Self {
            texts,
            entries,
            left,
            bottom,
        }
    }

    pub fn draw(&self, canvas: &Canvas, lines: &[Line]) -> Result<(), ReportError> {
        for (text, y, bold) in &self.texts {
            let (size, colour) = if *bold {
                (TITLE_SIZE, INK)
            } else {
                (TEXT_SIZE, QUIET_INK)
            };
            let form = TextForm {
                size,
                colour,
                bold: *bold,
                anchor: (HPos::Left, VPos::Top),
                upward: false,
            };
            canvas.text(text, (self.left, *y), form)?;
        }
        for (line, entry) in lines.iter().zip(&self.entries) {
            draw_entry(canvas, line, *entry)?;
        }
        Ok(())
    }
}

fn entries(lines: &[Line], edges: (f64, f64), top: f64) -> Vec<(f64, f64)> {
    let width = |line: &Line| {
        SWATCH + 8.0 + CHARACTER * TEXT_SIZE * label(line).chars().count() as f64 + 24.0
    };
    flow(&lines.iter().map(width).collect::<Vec<_>>(), edges, top)
}

/// Where entries of these widths begin: side by side, on a new row where the right edge is reached.
pub(super) fn flow(widths: &[f64], (left, right): (f64, f64), top: f64) -> Vec<(f64, f64)> {
    let (mut x, mut y) = (left, top);
    let mut entries = Vec::new();
    for width in widths {
        if x > left && x + width > right {
            (x, y) = (left, y + 20.0);
        }
        entries.push((x, y));
        x += width;
    }
    entries
}

fn draw_entry(canvas: &Canvas, line: &Line, (x, y): (f64, f64)) -> Result<(), ReportError> {
    let middle = y + 8.0;
    if line.measured.is_some() {
        let (top, bottom, end) = (middle - 6.0, middle + 6.0, x + SWATCH);
        canvas.area(
            &[(x, top), (end, top), (end, bottom), (x, bottom)],
            line.colour.mix(BAND),
        )?;
    }
    for dash in panel::dashes(line, &[(x, middle), (x + SWATCH, middle)]) {
        canvas.line(&dash, line.colour.to_rgba(), LINE_WIDTH)?;
    }
    let anchor = (HPos::Left, VPos::Center);
    let form = TextForm {
        size: TEXT_SIZE,
        colour: INK,
        bold: false,
        anchor,
        upward: false,
    };
    canvas.text(&label(line), (x + SWATCH + 8.0, middle), form)
}

fn label(line: &Line) -> String {
    if line.measured.is_some() {
        format!("{} (band: ±2σ)", line.name)
    } else {
        line.name.to_owned()
    }
}

/// Rows of at most so many characters, broken between words, or within one that is longer than a row.
pub(super) fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut rows = Vec::new();
    for line in text.lines() {
        let mut row = String::new();
        for piece in line.split_whitespace().flat_map(|word| pieces(word, most)) {
            if !row.is_empty() && row.chars().count() + 1 + piece.chars().count() > most {
                rows.push(core::mem::take(&mut row));
            }
            row = if row.is_empty() {
                piece
            } else {
                format!("{row} {piece}")
            };
        }
        rows.push(row);
    }
    rows
}

fn pieces(word: &str, most: usize) -> Vec<String> {
    let characters: Vec<char> = word.chars().collect();
    characters
        .chunks(most.max(1))
        .map(|piece| piece.iter().collect())
        .collect()
}
