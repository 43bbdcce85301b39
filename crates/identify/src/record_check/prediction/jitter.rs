//! Readings at irregular times that the record does not state.
//!
//! A reading that is late by d deviates by v d, with v the speed of the output. With independent times d of standard deviation s, the errors
//! of the prediction have
//!
//! ```text
//! variance        sigma^2 + b v^2                          b = s^2 (1 + sum a_i^2)
//! correlation     sum c_i c_(i + L) / sum c_i^2            c = (1, -a_1, -a_2, ...), of two errors L samples apart
//! ```
//!
//! the correlation of independent errors. Where they are large, the least squares choose coefficients for which the errors of the prediction are
//! less correlated: theirs lies between this correlation and 0. What the prediction does not describe of the motion has another one, and the
//! errors of play and rounding do not grow in proportion to the speed.

use super::{ORDER, Prediction, SpeedClass, median, speed_classes, speed_squared_before};

/// Classes count from that on whose variance is at least this multiple of the smallest one of the slowest quarter: sigma^2 is less than 5 %
/// of it.
const MIN_RATIO: f64 = 20.0;
/// Classes are fast whose v^2 is at least this part of that of the fastest.
const FAST_PART: f64 = 1.0 / 30.0;
/// So many fast classes tell whether their variance grows with the square of the speed.
const MIN_CLASSES: usize = 4;
/// Of eight in ten of the fast classes, the variance over v^2 agrees within this factor. That of a class of 256 is known within 13 % (standard
/// deviation of a squared median), which gives a factor of 1.4, and v^2 is that of some samples before: within a period it varies.
const MAX_SPREAD: f64 = 2.5;
/// The same of all classes that count: the prediction error of slow motion adds to theirs. Most irregular readings had factors of up to
/// 19 (66 records), play had 28, and noise in proportion to the output has 59, if not all of the motion is at one frequency.
const MAX_SPREAD_OF_ALL: f64 = 20.0;
/// Largest deviation of a correlation: that of some hundred samples is known within 0.05, noise beside the errors changes it by a twentieth,
/// and so does the error of the prediction.
const MAX_DEVIATION: f64 = 0.2;
/// Largest deviation from the correlation of independent errors, by the choice of the coefficients: up to 0.57 in 33 records with irregular
/// readings. Errors of play deviate by 0.86 and more.
const MAX_LOSS: f64 = 0.7;
/// Errors of more standard deviations count as this many: a spike has no weight.
const MAX_SIGMAS: f64 = 4.0;

impl Prediction<'_> {
    /// Standard deviation of the times of the readings in seconds, if the errors are those of irregular times.
    pub(in crate::record_check) fn jitter_s(&self) -> Option<f64> {
        let classes = speed_classes(&self.signals.output, &self.error);
        let slowest = &classes[..classes.len() / 4];
        let floor = slowest.iter().map(|class| class.variance);
        let floor = floor.reduce(f64::min)?;
        let counts = |class: &SpeedClass| class.variance > MIN_RATIO * floor;
        let all = &classes[classes.iter().position(counts)?..];
        let least = FAST_PART * all.last()?.typical_speed_squared;
        let is_fast = |class: &SpeedClass| class.typical_speed_squared >= least;
        let fast = &all[all.iter().position(is_fast)?..];
        if fast.len() < MIN_CLASSES || spread(fast) > MAX_SPREAD || spread(all) > MAX_SPREAD_OF_ALL
        {
            return None;
        }
        let by_speed = median(fast.iter().map(ratio).collect());
        let samples = by_speed.sqrt() / self.patterns.gain();
        let is_found = self.are_independent(by_speed, fast[0].typical_speed_squared);
        is_found.then(|| samples / self.signals.rate_hz)
    }

    /// Whether the errors of fast samples, whose variance is `by_speed` v^2, have the correlations of independent errors of readings.
    fn are_independent(&self, by_speed: f64, from_speed_squared: f64) -> bool {
        let normalised = |k: usize| {
            let speed_squared = speed_squared_before(&self.signals.output, k);
            let error = self.error[k] / (by_speed * speed_squared).sqrt();
            (speed_squared >= from_speed_squared).then(|| error.clamp(-MAX_SIGMAS, MAX_SIGMAS))
        };
        let errors: Vec<Option<f64>> = (0..self.error.len()).map(normalised).collect();
        (1..=ORDER).all(|lag| {
            let found = correlation(&errors, lag);
            let of_independent = self.patterns.correlation(lag);
            let nearest = found.clamp(of_independent.min(0.0), of_independent.max(0.0));
            (found - nearest).abs() < MAX_DEVIATION && (found - of_independent).abs() < MAX_LOSS
        })
    }
}

fn ratio(class: &SpeedClass) -> f64 {
    class.variance / class.typical_speed_squared
}

/// The ratio of the largest to the smallest [`ratio`] of at least four classes, without a tenth at each side.
fn spread(classes: &[SpeedClass]) -> f64 {
    let mut ratios: Vec<f64> = classes.iter().map(ratio).collect();
    ratios.sort_by(f64::total_cmp);
    let part = ratios.len().div_ceil(10);
    ratios[ratios.len() - 1 - part] / ratios[part]
}

/// The correlation of the numbers that are there with those a lag later.
fn correlation(numbers: &[Option<f64>], lag: usize) -> f64 {
    let (mut product, mut squares) = (0.0, 0.0);
    for pair in numbers.windows(lag + 1) {
        if let (Some(first), Some(last)) = (pair[0], pair[lag]) {
            product += first * last;
            squares += 0.5 * (first * first + last * last);
        }
    }
    product / squares
}
