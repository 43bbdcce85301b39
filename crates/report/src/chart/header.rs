//! Title and subtitle of a sheet, and text flow.

use super::canvas::Canvas;
use super::colours::SECONDARY_INK;
use super::text_style::{Horizontal, TextStyle, Vertical};

pub(super) const TEXT_SIZE: f64 = 12.5;
/// Largest mean width of a character in any usual sans-serif font, as a ratio of the font size.
pub(super) const CHARACTER: f64 = 0.6;
const BOLD_CHARACTER: f64 = 0.63;
const LINE_HEIGHT: f64 = 1.4;

const TITLE: TextStyle = TextStyle::new(17.0, Horizontal::Left, Vertical::Top).bold();
const SUBTITLE: TextStyle =
    TextStyle::new(TEXT_SIZE, Horizontal::Left, Vertical::Top).colour(SECONDARY_INK);

/// Lines of text, laid out below each other.
pub(super) struct TextBlock {
    lines: Vec<(String, f64, TextStyle)>,
    left: f64,
    /// Lower end.
    pub bottom: f64,
}

impl TextBlock {
    /// Title and subtitle over the width between two edges.
    pub fn header(title: &str, subtitle: &str, edges: (f64, f64)) -> Self {
        let mut block = TextBlock::new(edges.0, 14.0);
        block.append(title, TITLE, edges.1);
        block.append(subtitle, SUBTITLE, edges.1);
        block
    }

    pub fn new(left: f64, top: f64) -> Self {
        Self {
            lines: Vec::new(),
            left,
            bottom: top,
        }
    }

    /// Appends text, wrapped at the right edge.
    pub fn append(&mut self, text: &str, style: TextStyle, right: f64) {
        let character = if style.bold {
            BOLD_CHARACTER
        } else {
            CHARACTER
        };
        let most = (right - self.left) / (character * style.size);
        for line in wrapped(text, most as usize) {
            self.lines.push((line, self.bottom, style));
            self.bottom += LINE_HEIGHT * style.size;
        }
    }

    pub fn draw(&self, canvas: &mut Canvas) {
        for (text, y, style) in &self.lines {
            canvas.text(text, (self.left, *y), *style);
        }
    }
}

/// Lines of at most `most` characters, broken between words; a word that is longer than a line is broken as well.
fn wrapped(text: &str, most: usize) -> Vec<String> {
    text.lines()
        .flat_map(|line| wrapped_line(line, most))
        .collect()
}

fn wrapped_line(line: &str, most: usize) -> Vec<String> {
    let mut rows = vec![String::new()];
    for piece in line.split_whitespace().flat_map(|word| pieces(word, most)) {
        let row = rows
            .last_mut()
            .filter(|row| row.is_empty() || fits(row, &piece, most));
        match row {
            Some(row) if row.is_empty() => *row = piece,
            Some(row) => *row = format!("{row} {piece}"),
            None => rows.push(piece),
        }
    }
    rows
}

fn fits(row: &str, piece: &str, most: usize) -> bool {
    row.chars().count() + 1 + piece.chars().count() <= most
}

fn pieces(word: &str, most: usize) -> Vec<String> {
    let characters: Vec<char> = word.chars().collect();
    let pieces = characters.chunks(most.max(1));
    pieces.map(|piece| piece.iter().collect()).collect()
}
