//! Levels over frequency: what a stage answers where it is excited, and what stands between.

use super::ReportError;
use super::chart::{Chart, Pen, Scale, Symbol};
use super::colours::{BLUE, GREEN, GREY, VERMILION};
use super::sheet::{Row, sheet_svg};
use crate::identify::harmonics::LineLevel;

/// Points of an averaged line over the band at most.
const COLUMNS: f64 = 120.0;

/// The lines of a periodic record, each kind rising in frequency.
#[derive(Clone, Copy, Debug)]
pub struct LevelLines<'a> {
    /// Those that were excited.
    pub output: &'a [LineLevel],
    /// Odd ones left out.
    pub odd: &'a [LineLevel],
    /// Even ones.
    pub even: &'a [LineLevel],
    /// Periods of the mean.
    pub periods: usize,
}

/// The levels as an SVG document: RMS values in metres a line.
///
/// # Errors
/// When there is nothing to draw.
pub fn levels_svg(
    lines: &LevelLines<'_>,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let ends = lines
        .output
        .first()
        .zip(lines.output.last())
        .ok_or(ReportError::NoTrace)?;
    let ends_hz = (ends.0.frequency_hz, ends.1.frequency_hz);
    let frequency = Scale {
        range: (ends_hz.0 < ends_hz.1).then_some(ends_hz),
        ..Scale::logarithmic("Frequency (Hz)")
    };
    let mut all: Vec<LineLevel> = [lines.output, lines.odd, lines.even].concat();
    all.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
    let periods = lines.periods.max(1) as f64;
    let power = |level: &LineLevel| level.power_m2;
    let chart = Chart::new(
        "",
        frequency,
        Scale::logarithmic("Displacement a line, RMS (m)"),
    )
    .line(
        "excited lines",
        Pen {
            width: 1.2,
            ..Pen::solid(BLUE)
        },
        each(lines.output),
    )
    .line(
        "noise of the mean",
        Pen::solid(GREY),
        averaged(&all, |level| level.noise_m2 / periods),
    )
    .points(
        "odd lines left out",
        VERMILION,
        Symbol::Cross,
        averaged(lines.odd, power),
    )
    .points(
        "even lines",
        GREEN,
        Symbol::Ring,
        averaged(lines.even, power),
    );
    sheet_svg(title, subtitle, &[Row::new(420.0, vec![chart])])
}

fn each(lines: &[LineLevel]) -> Vec<(f64, f64)> {
    shown(lines.iter().map(|line| (line.frequency_hz, line.power_m2)))
}

/// RMS over all lines within the same part of ln f.
fn averaged(lines: &[LineLevel], of: impl Fn(&LineLevel) -> f64) -> Vec<(f64, f64)> {
    let (Some(first), Some(last)) = (lines.first(), lines.last()) else {
        return Vec::new();
    };
    let width = libm::log(last.frequency_hz / first.frequency_hz) / COLUMNS;
    let column = |line: &LineLevel| {
        if width > 0.0 {
            (libm::log(line.frequency_hz / first.frequency_hz) / width).floor()
        } else {
            0.0
        }
    };
    shown(lines.chunk_by(|a, b| column(a) == column(b)).map(|near| {
        let mean =
            |of: &dyn Fn(&LineLevel) -> f64| near.iter().map(of).sum::<f64>() / near.len() as f64;
        (mean(&|line| line.frequency_hz), mean(&of))
    }))
}

/// Roots of the powers; a logarithmic axis has no 0.
fn shown(powers: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    powers
        .filter(|(_, power)| *power > 0.0)
        .map(|(f, power)| (f, power.sqrt()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_root_mean_squares_and_lines_without_power_are_left_out() {
        let level = |frequency_hz: f64, power_m2: f64| LineLevel {
            frequency_hz,
            input_a2: 1.0,
            power_m2,
            noise_m2: 1.0,
            surprisal: 0.0,
        };
        let power = |level: &LineLevel| level.power_m2;
        // 1 to 1000 Hz: a column is exp(ln(1000)/120) = 5.9 % wide; 1 Hz begins the first, 100 and 101 Hz share the 80th.
        let lines = [
            level(1.0, 9.0),
            level(10.2, 0.0),
            level(101.0, 1.0),
            level(102.0, 7.0),
            level(1000.0, 25.0),
        ];
        let points = averaged(&lines, power);
        assert_eq!(points, [(1.0, 3.0), (101.5, 2.0), (1000.0, 5.0)]);
        assert_eq!(averaged(&lines[..1], power), [(1.0, 3.0)]);
        assert_eq!(averaged(&[], power), []);
    }

    #[test]
    fn nothing_excited_is_no_picture() {
        assert!(
            levels_svg(
                &LevelLines {
                    output: &[],
                    odd: &[],
                    even: &[],
                    periods: 4
                },
                "",
                ""
            )
            .is_err()
        );
    }
}
