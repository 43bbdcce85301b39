//! Axes: from values to pixels, and the places of ticks.

use super::scale::{Scale, ScaleKind};

/// A tick, with a label or without.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub value: f64,
    pub label: Option<String>,
}

/// Direction of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Direction {
    Horizontal,
    Vertical,
}

impl Direction {
    /// Least number of pixels between labelled ticks of a linear axis.
    fn spacing(self) -> f64 {
        match self {
            Direction::Horizontal => 74.0,
            Direction::Vertical => 40.0,
        }
    }
}

/// Values from `low` to `high` over the pixels from `start` to `end`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
    kind: ScaleKind,
}

impl Axis {
    pub fn new(kind: ScaleKind, (low, high): (f64, f64), (start, end): (f64, f64)) -> Self {
        Self {
            low,
            high,
            start,
            end,
            kind,
        }
    }

    /// Values at both ends.
    pub fn ends(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    /// The pixel of a value, beyond the ends of the axis too; NaN for values that a logarithmic axis cannot show.
    pub fn place(&self, value: f64) -> f64 {
        let ratio = match self.kind {
            ScaleKind::Logarithmic if value > 0.0 => {
                libm::log(value / self.low) / libm::log(self.high / self.low)
            }
            ScaleKind::Logarithmic => f64::NAN,
            _ => (value - self.low) / (self.high - self.low),
        };
        self.start + ratio * (self.end - self.start)
    }

    /// The pixel of a value; values beyond an end of the axis are moved to that end.
    pub fn pixel(&self, value: f64) -> f64 {
        let place = self.place(value);
        let (low, high) = (self.start.min(self.end), self.start.max(self.end));
        // Values of 0 and below lie beyond the lower end of any logarithmic axis.
        if place.is_nan() {
            self.start
        } else {
            place.clamp(low, high)
        }
    }

    pub fn ticks(&self, scale: &Scale, direction: Direction) -> Vec<Tick> {
        match (self.kind, direction) {
            (ScaleKind::Blank, _) => Vec::new(),
            (ScaleKind::Degrees, _) => self.degree_ticks(),
            (ScaleKind::Linear, _) => self.linear_ticks(self.even_step(direction.spacing())),
            (ScaleKind::Count, _) => {
                self.linear_ticks(self.even_step(direction.spacing()).max(1.0))
            }
            (ScaleKind::Logarithmic, Direction::Horizontal) => self.frequency_ticks(),
            (ScaleKind::Logarithmic, Direction::Vertical) => self.magnitude_ticks(),
        }
        .into_iter()
        .map(|tick| tick.numbered(scale.numbered))
        .collect()
    }

    /// The step of ticks that are at least `spacing` pixels apart.
    fn even_step(&self, spacing: f64) -> f64 {
        let count = ((self.end - self.start).abs() / spacing).max(1.0);
        nice_step((self.high - self.low) / count)
    }

    /// Ticks with plain numbers.
    fn frequency_ticks(&self) -> Vec<Tick> {
        let decades = self.decades();
        if decades < 0.7 {
            return self.linear_ticks(nice_step((self.high - self.low) / 7.0));
        }
        self.decade_ticks(|Decimal { digit, value, .. }| {
            let labelled = digit == 1 || (decades < 3.0 && (digit == 2 || digit == 5));
            labelled.then(|| plain(value))
        })
    }

    /// Ticks with powers of ten: one label for each decade, or fewer where there are too many decades.
    fn magnitude_ticks(&self) -> Vec<Tick> {
        let decades = self.decades();
        let every = (decades / 8.0).ceil().max(1.0) as i32;
        self.decade_ticks(|Decimal { digit, power, .. }| {
            let decade = digit == 1 && power.rem_euclid(every) == 0;
            let labelled = decade || (decades < 2.0 && (digit == 2 || digit == 5));
            labelled.then(|| power_of_ten(digit, power))
        })
    }

    /// Ticks at multiples of 30 degrees within half a turn, otherwise of 90, 180, 360 ... degrees.
    fn degree_ticks(&self) -> Vec<Tick> {
        let range = self.high - self.low;
        let mut step = if range < 185.0 { 30.0 } else { 90.0 };
        while range / step > 10.0 {
            step *= 2.0;
        }
        self.linear_ticks(step)
    }

    /// Ticks at whole multiples of a step.
    fn linear_ticks(&self, step: f64) -> Vec<Tick> {
        let first = (self.low / step - 1e-9).ceil() as i64;
        let last = (self.high / step + 1e-9).floor() as i64;
        let values = (first..=last).map(|k| k as f64 * step);
        values
            .map(|value| Tick {
                value,
                label: Some(plain(value)),
            })
            .collect()
    }

    fn decades(&self) -> f64 {
        libm::log10(self.high / self.low)
    }

    /// Ticks at 1 to 9 times each power of ten.
    fn decade_ticks(&self, label: impl Fn(Decimal) -> Option<String>) -> Vec<Tick> {
        let powers = libm::log10(self.low).floor() as i32..=libm::log10(self.high).ceil() as i32;
        let all = powers.flat_map(|power| (1..=9).map(move |digit| Decimal::new(digit, power)));
        let within = self.low * (1.0 - 1e-9)..=self.high * (1.0 + 1e-9);
        all.filter(|decimal| within.contains(&decimal.value))
            .map(|decimal| Tick {
                value: decimal.value,
                label: label(decimal),
            })
            .collect()
    }
}

/// A digit times a power of ten.
#[derive(Clone, Copy)]
struct Decimal {
    digit: i32,
    power: i32,
    value: f64,
}

impl Decimal {
    fn new(digit: i32, power: i32) -> Decimal {
        let value = f64::from(digit) * libm::pow(10.0, f64::from(power));
        Decimal {
            digit,
            power,
            value,
        }
    }
}

impl Tick {
    /// The same tick, its label only if `numbered`. Without a label it would be a fine line: an empty one remains.
    fn numbered(self, numbered: bool) -> Tick {
        let label = self
            .label
            .map(|label| if numbered { label } else { String::new() });
        Tick { label, ..self }
    }
}

/// 1, 2 or 5 times a power of ten, not below the given step.
fn nice_step(step: f64) -> f64 {
    let power = libm::pow(10.0, libm::log10(step).floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|digit| digit * power);
    let mut fitting = steps
        .into_iter()
        .filter(|nice| *nice >= step * (1.0 - 1e-9));
    fitting.next().unwrap_or(step)
}

/// A number without the noise of binary fractions: 0.3, not 0.30000000000000004.
fn plain(value: f64) -> String {
    let digits = (8 - libm::log10(value.abs().max(1e-9)).ceil() as i32).clamp(0, 15) as usize;
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') {
        text.trim_end_matches('0').trim_end_matches('.')
    } else {
        &text
    };
    text.replace('-', "\u{2212}")
}

/// `10⁻³`, `2·10⁻³`.
fn power_of_ten(digit: i32, power: i32) -> String {
    let power: String = power.to_string().chars().map(superscript).collect();
    match digit {
        1 => format!("10{power}"),
        _ => format!("{digit}\u{b7}10{power}"),
    }
}

fn superscript(character: char) -> char {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    character
        .to_digit(10)
        .map_or('⁻', |digit| DIGITS[digit as usize])
}
