//! Rest and motion at the ends of a record.

use super::defect::Defect;
use crate::Signals;

/// How a record begins and ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ends {
    /// At rest.
    Rest,
    /// Within periods, which are averaged.
    Periods,
    /// In motion, within an excitation that goes on all the time: the transient is estimated.
    Motion,
}

/// Samples at each end from which its velocity is determined, and number of such intervals.
const END_SAMPLES: usize = 16;
const END_INTERVALS: usize = 8;
/// A record is not at rest if its velocity exceeds this ratio of its root mean square, and noise by this factor.
const MOVING_RATIO: f64 = 0.1;
const MOVING_SIGMAS: f64 = 8.0;

/// The start of a record is one of this number of parts.
const PARTS: usize = 200;
/// Samples below this ratio of the largest one precede an excitation, as those before the blow of a hammer. Noise whose largest value is
/// four standard deviations stays below it for 0.025 of its mean period: it passes zero with fewer than [`END_SAMPLES`] of them, unless
/// its frequencies lie below a six-hundredth of the rate.
const QUIET_RATIO: f64 = 0.02;

/// The RMS value of the input at the start of the record as a ratio of that of the whole record.
pub fn input_ratio_at_start(signals: &Signals) -> f64 {
    let input = &signals.input;
    rms(start(input)) / rms(input)
}

/// The samples before the excitation, if it begins within the first of the [`PARTS`]; otherwise this part.
pub(super) fn start(input: &[f64]) -> &[f64] {
    let first = &input[..input.len().div_ceil(PARTS)];
    let largest = input.iter().fold(0.0_f64, |max, x| max.max(x.abs()));
    let is_quiet = |x: &&f64| x.abs() < QUIET_RATIO * largest;
    let quiet = first.iter().take_while(is_quiet).count();
    if quiet < END_SAMPLES {
        first
    } else {
        &first[..quiet]
    }
}

/// The RMS value of the input at the end of the record, about its mean there, as a ratio of that of the whole record: a set-point may end
/// elsewhere than it began.
pub fn input_ratio_at_end(signals: &Signals) -> f64 {
    let input = &signals.input;
    let last = &input[input.len() - input.len().div_ceil(PARTS)..];
    let mean = last.iter().sum::<f64>() / last.len() as f64;
    let about_mean: Vec<f64> = last.iter().map(|x| x - mean).collect();
    rms(&about_mean) / rms(input)
}

/// Motion of the output at its ends, where its noise has the given standard deviation.
pub(super) fn motion_at_ends(signals: &Signals, noise: f64) -> Vec<Defect> {
    let output = &signals.output;
    let count = END_SAMPLES * END_INTERVALS;
    if output.len() < 4 * count {
        return Vec::new();
    }
    let of = |samples: &[f64]| samples.chunks_exact(END_SAMPLES).map(slope).collect();
    let all: Vec<f64> = of(output);
    let rms = rms(&all);
    // The slope of n samples of noise has the variance 12 sigma^2/n^3.
    let limit = MOVING_SIGMAS * noise * (12.0 / (END_SAMPLES as f64).powi(3)).sqrt();
    let moving = |velocity: f64| velocity > limit && velocity > MOVING_RATIO * rms;
    let start = all[0].abs();
    let last: Vec<f64> = of(&output[output.len() - count..]);
    let end = self::rms(&last);
    let mut found = Vec::new();
    if moving(start) {
        found.push(Defect::MovingAtStart { ratio: start / rms });
    }
    if moving(end) {
        found.push(Defect::MovingAtEnd { ratio: end / rms });
    }
    found
}

fn rms(values: &[f64]) -> f64 {
    let squares: f64 = values.iter().map(|value| value * value).sum();
    (squares / values.len() as f64).sqrt()
}

/// The slope per sample of the least-squares line.
fn slope(samples: &[f64]) -> f64 {
    let middle = (samples.len() - 1) as f64 / 2.0;
    let moments = samples.iter().enumerate();
    let product: f64 = moments.map(|(n, y)| (n as f64 - middle) * y).sum();
    let n = samples.len() as f64;
    product / (n * (n * n - 1.0) / 12.0)
}
