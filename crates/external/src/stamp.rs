//! A time as it stands in a file, with its rounding.

use bench_arrays::Precision;
use jiff::civil::DateTime;
use jiff::{Timestamp, tz};

/// A time as written, exact also for nanoseconds since 1970.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stamp {
    whole: i128,
    fraction: f64,
    /// Digits after the point; `None` for a number with an exponent.
    decimals: Option<u32>,
    /// Digits from the first one that is not 0.
    significant: u32,
    /// Distance to the next number of the binary format in which it is stored, in its unit; 0 for text.
    spacing: f64,
    /// Whether it is a date, whose unit is the second.
    is_date: bool,
}

/// Whether a cell is a date with a time.
pub(crate) fn is_stamp(cell: &str) -> bool {
    date(cell).is_some()
}

/// Nanoseconds since 1970 of a date, with or without the offset of its zone.
fn date(cell: &str) -> Option<i128> {
    // Cheap to refuse: a date has at least `2026-11-26T12:40`.
    if cell.len() < 16 || !cell.is_char_boundary(10) || !cell[..10].contains('-') {
        return None;
    }
    let timestamp = cell.parse::<Timestamp>().ok().or_else(|| {
        let civil: DateTime = cell.parse().ok()?;
        tz::TimeZone::UTC.to_timestamp(civil).ok()
    });
    timestamp.map(Timestamp::as_nanosecond)
}

impl Stamp {
    /// The time in a cell, with this decimal separator.
    pub fn parse(cell: &str, decimal_comma: bool) -> Option<Stamp> {
        let point = if decimal_comma { ',' } else { '.' };
        Stamp::decimal(cell, point)
            .or_else(|| Stamp::date(cell))
            .or_else(|| Stamp::floating(&cell.replacen(point, ".", 1)))
    }

    /// The time of a binary number of this format: that of the shortest text from which it is read back, which is how a program would
    /// have written it. So times that were rounded to decimals are recognised as in a text.
    pub fn real(number: f64, precision: Precision) -> Option<Stamp> {
        let text = match precision {
            Precision::Double => number.to_string(),
            Precision::Single | Precision::Half => (number as f32).to_string(),
        };
        let spacing = precision.spacing(number);
        Stamp::parse(&text, false).map(|stamp| Stamp { spacing, ..stamp })
    }

    /// The time of an integer.
    pub fn integer(number: i64) -> Stamp {
        Stamp {
            whole: number.into(),
            fraction: 0.0,
            decimals: Some(0),
            significant: significant_digits(&number.to_string()),
            spacing: 0.0,
            is_date: false,
        }
    }

    fn decimal(cell: &str, point: char) -> Option<Stamp> {
        let (whole, digits) = cell.split_once(point).unwrap_or((cell, ""));
        if !digits.bytes().all(|byte| byte.is_ascii_digit()) || digits.len() > 18 {
            return None;
        }
        let sign = if whole.starts_with('-') { -1.0 } else { 1.0 };
        let whole = match whole {
            "" | "-" | "+" if !digits.is_empty() => 0,
            whole => whole.parse().ok()?,
        };
        let fraction = if digits.is_empty() {
            0.0
        } else {
            sign * format!("0.{digits}").parse::<f64>().ok()?
        };
        Some(Stamp {
            whole,
            fraction,
            decimals: Some(digits.len() as u32),
            significant: significant_digits(cell),
            spacing: 0.0,
            is_date: false,
        })
    }

    fn date(cell: &str) -> Option<Stamp> {
        const NS_PER_S: i128 = 1_000_000_000;
        let ns = date(cell)?;
        let digits = cell.rsplit_once(['.', ',']).map_or(0, |(_, rest)| {
            rest.bytes().take_while(u8::is_ascii_digit).count() as u32
        });
        Some(Stamp {
            whole: ns.div_euclid(NS_PER_S),
            fraction: ns.rem_euclid(NS_PER_S) as f64 * 1e-9,
            decimals: Some(digits),
            // A date has as many digits as its time since 1970.
            significant: 11 + digits,
            spacing: 0.0,
            is_date: true,
        })
    }

    fn floating(text: &str) -> Option<Stamp> {
        let number: f64 = text.parse().ok()?;
        // Beyond 2^63 no clock counts.
        (number.abs() < 9.2e18).then(|| Stamp {
            whole: number.trunc() as i128,
            fraction: number.fract(),
            decimals: None,
            significant: significant_digits(text),
            spacing: 0.0,
            is_date: false,
        })
    }

    /// Whether it is a date, whose unit is the second.
    pub fn is_date(&self) -> bool {
        self.is_date
    }

    /// The last digit that it would have with this number of significant digits, in its unit.
    fn digit(&self, significant: u32) -> f64 {
        let size = (self.whole as f64 + self.fraction).abs();
        if size > 0.0 {
            10_f64.powi(size.log10().floor() as i32 + 1 - significant as i32)
        } else {
            0.0
        }
    }

    /// The time from another one, in the unit of both.
    pub fn since(&self, start: &Stamp) -> f64 {
        self.whole.saturating_sub(start.whole) as f64 + (self.fraction - start.fraction)
    }
}

/// Digits of a number from the first one that is not 0, without an exponent.
fn significant_digits(text: &str) -> u32 {
    let mantissa = text.split(['e', 'E']).next().unwrap_or_default();
    let digits = mantissa.bytes().filter(u8::is_ascii_digit);
    digits.skip_while(|digit| *digit == b'0').count() as u32
}

/// The last digit of each stamp. A program writes all with the same number of decimals or of significant digits, and may leave out
/// zeros at the end: the most of each count, and the coarser digit of both. Binary numbers are rounded to their format as well.
pub(crate) fn digits(stamps: &[Stamp]) -> Vec<f64> {
    let significant = stamps.iter().map(|stamp| stamp.significant).max();
    let significant = significant.unwrap_or_default();
    let decimals: Option<Vec<u32>> = stamps.iter().map(|stamp| stamp.decimals).collect();
    let most = decimals.and_then(|decimals| decimals.into_iter().max());
    let finest = most.map_or(0.0, |decimals| 0.1_f64.powi(decimals as i32));
    let digit = |stamp: &Stamp| finest.max(stamp.digit(significant)).max(stamp.spacing);
    stamps.iter().map(digit).collect()
}
