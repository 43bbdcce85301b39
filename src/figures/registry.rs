//! All figures and tables: one line each, in the order of the thesis.

use super::chapter6::*;
use super::{Content, FigureError, Workshop};

/// A figure or table of the thesis.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// `2-5`, or `table-2-2`.
    pub number: &'static str,
    /// As its caption.
    pub title: &'static str,
    /// How it is made, or why not.
    pub make: Make,
}

/// How a figure is made.
#[derive(Clone, Copy, Debug)]
pub enum Make {
    /// By this function.
    Draw(fn(&Workshop) -> Result<Content, FigureError>),
    /// It cannot be computed, and this is why.
    Not(&'static str),
}

impl Entry {
    /// `Fig 2-5`, `Table 2-2`.
    pub fn name(&self) -> String {
        match self.number.strip_prefix("table-") {
            Some(number) => format!("Table {number}"),
            None => format!("Fig {}", self.number),
        }
    }

    /// Name and title.
    pub fn heading(&self) -> String {
        format!("{}. {}", self.name(), self.title)
    }

    /// Its anchor on the page.
    pub fn id(&self) -> String {
        if self.number.starts_with("table-") { self.number.into() } else { format!("fig-{}", self.number) }
    }

    /// The name of its SVG.
    pub fn file(&self) -> String {
        format!("{}.svg", self.id())
    }

    /// `2`.
    pub fn chapter(&self) -> &'static str {
        let number = self.number.trim_start_matches("table-");
        number.split('-').next().unwrap_or(number)
    }
}

const fn draw(number: &'static str, title: &'static str, make: fn(&Workshop) -> Result<Content, FigureError>) -> Entry {
    Entry { number, title, make: Make::Draw(make) }
}

const fn not(number: &'static str, title: &'static str, why: &'static str) -> Entry {
    Entry { number, title, make: Make::Not(why) }
}

/// All entries.
pub const FIGURES: &[Entry] = &[
    not("6-1", "Classic control loop with unity feedback", "a block diagram without figures"),
    draw("6-2", "Characteristics of a controller with a bandwidth below the first resonance", fig_6_2),
    draw("6-3", "Properties of the numerical set 7.98, −1.65, 1.52", fig_6_3),
    draw("6-4", "Compensator and open loop transfer function", fig_6_4),
    draw("6-5", "Properties of the numerical set 7.98, 1.65, −1.52", fig_6_5),
    draw("6-6", "Controllers with different damping ratios", fig_6_6),
    draw("6-7", "Frequency response of SR4DoF, model and measurement", fig_6_7),
    draw("6-8", "First controller (slow), open loop transfer function", fig_6_8),
    draw("6-9", "The close modes under an increasing operating point", fig_6_9),
    draw("6-10", "Second controller (fast), open loop transfer function", fig_6_10),
    draw("6-11", "Comparison between fast and slow controller", fig_6_11),
    draw("6-12", "Comparison between fast and slow controller, with the measured plant", fig_6_12),
    draw("6-13", "Fast and slow control, measured", fig_6_13),
];

/// The entries of these numbers, in the order of the thesis; all of them for no number.
pub fn selected(numbers: &[String]) -> Result<Vec<&'static Entry>, FigureError> {
    let known = |number: &String| FIGURES.iter().any(|entry| entry.number == number.trim());
    if let Some(unknown) = numbers.iter().find(|number| !known(number)) {
        let known = FIGURES.iter().map(|entry| entry.number).collect::<Vec<_>>().join(", ");
        return Err(FigureError::Unknown { unknown: format!("`{}`", unknown.trim()), known });
    }
    let wanted = |entry: &&Entry| numbers.is_empty() || numbers.iter().any(|number| number.trim() == entry.number);
    Ok(FIGURES.iter().filter(wanted).collect())
}
