//! Axes: from values to pixels, and where to put ticks.

/// A tick, with a label where there is one.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    pub value: f64,
    pub label: Option<String>,
}

/// Values from `low` to `high` over the pixels from `start` to `end`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
    logarithmic: bool,
}

impl Axis {
    pub fn linear((low, high): (f64, f64), (start, end): (f64, f64)) -> Self {
        Self {
            low,
            high,
            start,
            end,
            logarithmic: false,
        }
    }

    pub fn logarithmic((low, high): (f64, f64), (start, end): (f64, f64)) -> Self {
        Self {
            low,
            high,
            start,
            end,
            logarithmic: true,
        }
    }

    /// The pixel of a value; values beyond an end of the axis are put there.
    pub fn pixel(&self, value: f64) -> f64 {
        let part = if self.logarithmic {
            // Values of 0 and below are past the lower end of any logarithmic axis.
            libm::log(value.max(f64::MIN_POSITIVE) / self.low) / libm::log(self.high / self.low)
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.start + part.clamp(0.0, 1.0) * (self.end - self.start)
    }

    /// The pixel of a value, beyond the ends of the axis too; not a number for values that a logarithmic axis cannot show.
    pub fn place(&self, value: f64) -> f64 {
        let part = if self.logarithmic {
            if value > 0.0 {
                libm::log(value / self.low) / libm::log(self.high / self.low)
            } else {
                f64::NAN
            }
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.start + part * (self.end - self.start)
    }

    /// Ticks of an even axis, so many pixels apart at least, labelled in plain numbers.
    pub fn even_ticks(&self, pixels: f64) -> Vec<Tick> {
        let count = ((self.end - self.start).abs() / pixels).max(1.0);
        self.linear_ticks(nice_step((self.high - self.low) / count), plain)
    }

    /// Ticks of a frequency axis, labelled in plain numbers.
    pub fn frequency_ticks(&self) -> Vec<Tick> {
        let decades = self.decades();
        if decades < 0.7 {
            return self.linear_ticks(nice_step((self.high - self.low) / 7.0), plain);
        }
        self.decade_ticks(
            |digit, _| digit == 1 || (decades < 3.0 && (digit == 2 || digit == 5)),
            |value, _, _| plain(value),
        )
    }

    /// Ticks of a magnitude axis, labelled in powers of ten.
    pub fn magnitude_ticks(&self) -> Vec<Tick> {
        let decades = self.decades();
        // A label a decade is enough, unless there are so many that they would touch.
        let every = (decades / 8.0).ceil().max(1.0) as i32;
        let labelled = |digit, power: i32| {
            (digit == 1 && power.rem_euclid(every) == 0)
                || (decades < 2.0 && (digit == 2 || digit == 5))
        };
        self.decade_ticks(labelled, |_, digit, power| power_of_ten(digit, power))
    }

    /// Ticks at whole multiples of 90 degrees, or of 180, 360 ... where these are too many.
    pub fn phase_ticks(&self) -> Vec<Tick> {
        let mut step = 90.0;
        while (self.high - self.low) / step > 10.0 {
            step *= 2.0;
        }
        self.linear_ticks(step, plain)
    }

    /// The same, at whole multiples of 30 degrees where there is less than half a turn.
    pub fn degree_ticks(&self) -> Vec<Tick> {
        if self.high - self.low < 185.0 {
            self.linear_ticks(30.0, plain)
        } else {
            self.phase_ticks()
        }
    }

    /// Ticks at whole multiples of a step.
    pub fn linear_ticks(&self, step: f64, label: impl Fn(f64) -> String) -> Vec<Tick> {
        let (first, last) = (
            (self.low / step - 1e-9).ceil() as i64,
            (self.high / step + 1e-9).floor() as i64,
        );
        let tick = |k: i64| Tick {
            value: k as f64 * step,
            label: Some(label(k as f64 * step)),
        };
        (first..=last).map(tick).collect()
    }

    fn decades(&self) -> f64 {
        libm::log10(self.high / self.low)
    }

    fn decade_ticks(
        &self,
        labelled: impl Fn(i32, i32) -> bool,
        label: impl Fn(f64, i32, i32) -> String,
    ) -> Vec<Tick> {
        let powers = libm::log10(self.low).floor() as i32..=libm::log10(self.high).ceil() as i32;
        let all = powers.flat_map(|power| (1..=9).map(move |digit| (digit, power)));
        let tick = |(digit, power): (i32, i32)| {
            let value = f64::from(digit) * libm::pow(10.0, f64::from(power));
            let label = labelled(digit, power).then(|| label(value, digit, power));
            (value >= self.low * (1.0 - 1e-9) && value <= self.high * (1.0 + 1e-9))
                .then_some(Tick { value, label })
        };
        all.filter_map(tick).collect()
    }
}

/// 1, 2 or 5 times a power of ten, not below the given step.
fn nice_step(step: f64) -> f64 {
    let power = libm::pow(10.0, libm::log10(step).floor());
    [1.0, 2.0, 5.0, 10.0]
        .map(|digit| digit * power)
        .into_iter()
        .find(|nice| *nice >= step * (1.0 - 1e-9))
        .unwrap_or(step)
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

/// 10 to a power, 2x10 to a power ..., with the power raised.
fn power_of_ten(digit: i32, power: i32) -> String {
    const RAISED: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let factor = if digit == 1 {
        String::new()
    } else {
        format!("{digit}\u{b7}")
    };
    let raised = power
        .to_string()
        .chars()
        .map(|c| c.to_digit(10).map_or('⁻', |digit| RAISED[digit as usize]))
        .collect::<String>();
    format!("{factor}10{raised}")
}
