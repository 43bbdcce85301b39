//! Distortion separated from noise, by the lines that a periodic excitation omits.
//!
//! A plant with an excitation of odd lines, some of which are omitted, responds
//!
//! ```text
//!  at excited lines            the linear response, odd distortion, noise
//!  at omitted odd lines                             odd distortion, noise      sums of an odd number of odd lines
//!  at even lines                                    even distortion, noise     sums of an even number of odd lines
//! ```
//!
//! Distortion repeats in every period and noise does not. With Y_p the spectrum of period p of P, m their mean and s^2 their
//! scatter,
//!
//! ```text
//!  m = mean of Y_p     s^2 = sum |Y_p - m|^2 / (P - 1)     E |m|^2 = |distortion|^2 + s^2/P
//! ```
//!
//! so |m|^2 - s^2/P estimates the power of distortion without bias. For noise alone, F = P |m|^2 / s^2 has Fisher's
//! distribution of 2 and 2 (P - 1) degrees of freedom, whose tail is exact and independent of the power of the noise:
//!
//! ```text
//!  P(F exceeded) = (1 + F/(P - 1))^-(P - 1)       - sum of ln P over M lines: Gamma distributed, shape M
//! ```
//!
//! (Fisher's method; the noise may differ from line to line.) Levels are squares of RMS values in m^2: 2 |Y|^2/N^2 with N samples
//! in a period. Pintelon, Schoukens, System Identification, 2nd ed., section 4.3: the fast method, with one realization of the
//! phases.
//!
//! **A measured input** contains distortion of the amplifier at the omitted lines, to which the plant responds linearly. With H
//! interpolated between the excited lines by a local model, H U_p is subtracted from Y_p there, and only the lines between the lowest and
//! the highest excited one count (Pintelon, Schoukens, the same section).
//!
//! A disturbance at exactly a line (mains, with periods of whole seconds) also repeats in every period and counts as distortion;
//! in the probability, one line weighs no more than ln(level).

use nalgebra::Complex;

use super::distortion::interpolated;
use super::excited::excited;
use super::lines::{Line, ROUNDING, Repetition, lines, mean, variance_of_mean};
use crate::{FrfDatum, IdentifyError, Signals};

/// A line is omitted if its input is below this ratio of the largest. With an excited line of a hundredth, a linear plant then
/// responds with a thousandth of its amplitude.
const OMITTED_RATIO: f64 = 1e-5;
/// Number of lines of a kind that are averaged around a frequency.
const NEIGHBOURS: usize = 4;

/// One line of the output.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineLevel {
    /// Frequency in hertz.
    pub frequency_hz: f64,
    /// Square of the RMS of the mean input in A^2.
    pub input_a2: f64,
    /// Square of the RMS of the mean of all periods in m^2.
    pub power_m2: f64,
    /// Square of the RMS of the noise of one period in m^2.
    pub noise_m2: f64,
    /// -ln of the probability that noise alone gives a mean as large.
    pub surprisal: f64,
}

/// The lines of a band.
#[derive(Clone, Debug, PartialEq)]
pub struct Harmonics {
    /// The excited lines, all of them odd.
    pub excited: Vec<LineLevel>,
    /// The omitted odd lines.
    pub odd: Vec<LineLevel>,
    /// The even lines.
    pub even: Vec<LineLevel>,
    /// Number of averaged periods.
    pub periods: usize,
}

/// What the input signal is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InputSignal {
    /// A command, which is exactly 0 at the omitted lines.
    Commanded,
    /// A measured signal with distortion of its own.
    Measured,
}

/// The lines of `band_hz`; `None` if no line shows distortion: none is omitted, or even lines are excited.
///
/// # Errors
/// When the signals, the band or the periods allow no estimate: see [`IdentifyError`].
pub fn harmonics(
    signals: &Signals,
    band_hz: (f64, f64),
    repetition: Repetition,
    input: InputSignal,
) -> Result<Option<Harmonics>, IdentifyError> {
    let lines = lines(signals, band_hz, repetition)?;
    let scale = Scale::new(&lines, signals.rate_hz, repetition.period);
    let excited: Vec<&Line> = excited(&lines).collect();
    let omitted = match input {
        InputSignal::Commanded => scale.silent(&lines),
        InputSignal::Measured => between(&lines, &excited),
    };
    let levels = |parity: usize| -> Vec<LineLevel> {
        let of_parity = omitted.iter().filter(|line| line.number % 2 == parity);
        of_parity.map(|line| scale.level(line)).collect()
    };
    let harmonics = Harmonics {
        excited: excited.iter().map(|line| scale.level(line)).collect(),
        odd: levels(1),
        even: levels(0),
        periods: scale.periods,
    };
    let only_odd = excited.iter().all(|line| line.number % 2 == 1);
    let omitted = harmonics.odd.len() + harmonics.even.len();
    Ok((only_odd && !harmonics.excited.is_empty() && omitted > 0).then_some(harmonics))
}

/// Conversion of sums over a period to levels.
struct Scale {
    line_hz: f64,
    /// (sqrt(2)/N)^2.
    square: f64,
    periods: usize,
    max_input: f64,
    /// Power below which a scatter is rounding.
    rounding: f64,
}

impl Scale {
    fn new(lines: &[Line], rate_hz: f64, period: usize) -> Scale {
        let max_input = max_amplitude(lines.iter().map(|line| &line.input));
        let max_output = max_amplitude(lines.iter().map(|line| &line.output));
        Scale {
            line_hz: rate_hz / period as f64,
            square: 2.0 / (period as f64 * period as f64),
            periods: lines.first().map_or(0, |line| line.output.len()),
            max_input,
            rounding: (ROUNDING * max_output).powi(2).max(f64::MIN_POSITIVE),
        }
    }

    /// The lines without input.
    fn silent(&self, lines: &[Line]) -> Vec<Line> {
        let silent = lines.iter().filter(|line| self.is_omitted(line));
        silent.cloned().collect()
    }

    fn is_omitted(&self, line: &Line) -> bool {
        mean(&line.input).norm() <= OMITTED_RATIO * self.max_input
    }

    fn level(&self, line: &Line) -> LineLevel {
        let (power, of_mean) = (
            mean(&line.output).norm_sqr(),
            variance_of_mean(&line.output),
        );
        let freedom = self.periods as f64 - 1.0;
        LineLevel {
            frequency_hz: line.number as f64 * self.line_hz,
            input_a2: self.square * mean(&line.input).norm_sqr(),
            power_m2: self.square * power,
            noise_m2: self.square * self.periods as f64 * of_mean,
            surprisal: freedom * libm::log1p(power / (freedom * (of_mean + self.rounding))),
        }
    }
}

/// The other lines between the excited ones, without the linear response to their input.
fn between(lines: &[Line], excited: &[&Line]) -> Vec<Line> {
    let (Some(first), Some(last)) = (excited.first(), excited.last()) else {
        return Vec::new();
    };
    let numbers: Vec<usize> = excited.iter().map(|line| line.number).collect();
    let response: Vec<FrfDatum> = excited.iter().map(|line| datum(line)).collect();
    let inner = lines.iter().filter(|line| {
        (first.number..last.number).contains(&line.number) && !numbers.contains(&line.number)
    });
    let without = inner.filter_map(|line| {
        let response = interpolated(&response, line.number as f64)?;
        Some(line.without_linear_part(response))
    });
    without.collect()
}

/// The response at a line, with its number as the frequency.
fn datum(line: &Line) -> FrfDatum {
    FrfDatum {
        frequency_hz: line.number as f64,
        spread_hz: 0.0,
        response: line.response(),
        variance: line.variance(),
    }
}

/// The largest magnitude of the mean over the periods.
fn max_amplitude<'a>(lines: impl Iterator<Item = &'a Vec<Complex<f64>>>) -> f64 {
    lines.map(|line| mean(line).norm()).fold(0.0, f64::max)
}

impl Harmonics {
    /// The power of a line without its noise, in m^2; without bias, and therefore sometimes negative.
    pub fn without_noise_m2(&self, level: &LineLevel) -> f64 {
        level.power_m2 - level.noise_m2 / self.periods as f64
    }

    /// The mean of [`Self::without_noise_m2`] of the lines nearest to a frequency, of lines with rising frequency; 0 without lines.
    pub(super) fn around_m2(&self, lines: &[LineLevel], frequency_hz: f64) -> f64 {
        let above = lines.partition_point(|line| line.frequency_hz < frequency_hz);
        let first = above
            .saturating_sub(NEIGHBOURS / 2)
            .min(lines.len().saturating_sub(NEIGHBOURS));
        let near = &lines[first..(first + NEIGHBOURS).min(lines.len())];
        near.iter()
            .map(|line| self.without_noise_m2(line))
            .sum::<f64>()
            / near.len().max(1) as f64
    }
}

/// The probability that noise alone gives lines as large: exp(-x) sum of x^j/j! for j below their number, x the sum of their
/// surprisals. 1 without lines.
pub fn noise_probability(lines: &[LineLevel]) -> f64 {
    let x: f64 = lines.iter().map(|line| line.surprisal).sum();
    if lines.is_empty() || x <= 0.0 {
        return 1.0;
    }
    if !x.is_finite() {
        return 0.0;
    }
    let indices = (0..lines.len()).map(|j| j as f64);
    let terms = indices.map(|j| libm::exp(j * libm::log(x) - x - libm::lgamma(j + 1.0)));
    terms.sum::<f64>().min(1.0)
}
