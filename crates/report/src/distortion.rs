//! Output, noise and distortion of a periodic record over frequency.

use super::ReportError;
use super::chart::colours::{BLUE, GREEN, GREY, VERMILION};
use super::chart::{Chart, Pen, Row, Scale, Symbol, sheet_svg};
use bench_identify::harmonics::{Harmonics, LineLevel};

/// Largest number of points of an averaged line.
const COLUMNS: f64 = 120.0;

/// The lines of a periodic record, each kind rising in frequency.
#[derive(Clone, Copy, Debug)]
pub struct DistortionLevels<'a> {
    /// Excited lines.
    pub output: &'a [LineLevel],
    /// Odd lines that were not excited.
    pub odd: &'a [LineLevel],
    /// Even lines.
    pub even: &'a [LineLevel],
    /// Number of averaged periods.
    pub periods: usize,
}

impl<'a> From<&'a Harmonics> for DistortionLevels<'a> {
    fn from(harmonics: &'a Harmonics) -> Self {
        DistortionLevels {
            output: &harmonics.excited,
            odd: &harmonics.odd,
            even: &harmonics.even,
            periods: harmonics.periods,
        }
    }
}

impl DistortionLevels<'_> {
    /// All lines by frequency.
    fn all(&self) -> Vec<LineLevel> {
        let mut all = [self.output, self.odd, self.even].concat();
        all.sort_by(|a, b| a.frequency_hz.total_cmp(&b.frequency_hz));
        all
    }
}

/// The levels as an SVG document: RMS values per line of a quantity, such as `Displacement` in `m`.
///
/// # Errors
/// When no line was excited.
pub fn distortion_svg(
    levels: &DistortionLevels<'_>,
    quantity: &str,
    title: &str,
    subtitle: &str,
) -> Result<String, ReportError> {
    let (Some(first), Some(last)) = (levels.output.first(), levels.output.last()) else {
        return Err(ReportError::NoTrace);
    };
    let x = Scale::frequency((first.frequency_hz, last.frequency_hz));
    let y = Scale::logarithmic(&format!("{quantity} per line, RMS"));
    let chart = with_levels(Chart::new("", x, y), levels);
    sheet_svg(title, subtitle, &[Row::new(420.0, vec![chart])])
}

fn with_levels(chart: Chart, levels: &DistortionLevels<'_>) -> Chart {
    let output = levels.output.iter();
    let output = rms(output.map(|level| (level.frequency_hz, level.power_m2)));
    let periods = levels.periods.max(1) as f64;
    let noise = averaged(&levels.all(), |level| level.noise_m2 / periods);
    let [odd, even] = [levels.odd, levels.even].map(|lines| averaged(lines, |line| line.power_m2));
    chart
        .line("excited lines", Pen::solid(BLUE).width(1.2), output)
        .line("noise of the mean", Pen::solid(GREY), noise)
        .points("odd lines, not excited", VERMILION, Symbol::Cross, odd)
        .points("even lines, not excited", GREEN, Symbol::Ring, even)
}

/// RMS over all lines within the same column of ln f.
fn averaged(levels: &[LineLevel], power: impl Fn(&LineLevel) -> f64) -> Vec<(f64, f64)> {
    let (Some(first), Some(last)) = (levels.first(), levels.last()) else {
        return Vec::new();
    };
    let columns = Columns {
        first_hz: first.frequency_hz,
        width: libm::log(last.frequency_hz / first.frequency_hz) / COLUMNS,
    };
    let near = levels.chunk_by(|a, b| columns.of(a) == columns.of(b));
    rms(near.map(|near| (mean(near, |level| level.frequency_hz), mean(near, &power))))
}

/// Columns of equal width in ln f.
struct Columns {
    first_hz: f64,
    width: f64,
}

impl Columns {
    /// The number of the column of a line.
    fn of(&self, level: &LineLevel) -> f64 {
        if self.width > 0.0 {
            (libm::log(level.frequency_hz / self.first_hz) / self.width).floor()
        } else {
            0.0
        }
    }
}

fn mean(levels: &[LineLevel], value: impl Fn(&LineLevel) -> f64) -> f64 {
    levels.iter().map(value).sum::<f64>() / levels.len() as f64
}

/// Roots of the powers above 0; a logarithmic axis does not show 0.
fn rms(powers: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let positive = powers.filter(|(_, power)| *power > 0.0);
    positive.map(|(f, power)| (f, power.sqrt())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rms_averages_omit_lines_without_power() {
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
    fn rejects_a_record_without_excited_lines() {
        let levels = DistortionLevels {
            output: &[],
            odd: &[],
            even: &[],
            periods: 4,
        };
        assert_eq!(
            distortion_svg(&levels, "", "", ""),
            Err(ReportError::NoTrace)
        );
    }
}
