//! The periods at the beginning of a periodic record in which the plant settles.
//!
//! ```text
//! d_p = |x_p - mean of the second half of the periods|       RMS over a period without its drift, of input and of output
//! ```
//!
//! A period is settled if d_p is at most twice the median of the second half, where the plant has settled; noise changes d_p by a few
//! percent. Only periods before the first settled one are transient: a later period that differs is a disturbance.

use super::lines::{MIN_PERIODS, Repetition, averaged_periods, without_drift};
use crate::{IdentifyError, Signals};

/// Ratio to the median distance above which a period is not settled.
const UNSETTLED_RATIO: f64 = 2.0;

/// Number of periods of `period` samples to omit; at most half of the periods.
///
/// # Errors
/// When the period does not suit the record: see [`IdentifyError`].
pub fn settling_periods(signals: &Signals, period: usize) -> Result<usize, IdentifyError> {
    signals.check()?;
    let count = averaged_periods(signals.len(), Repetition { period, skip: 0 })?;
    let records = [&signals.input, &signals.output];
    let skips = records.map(|samples| leading_unsettled(&distances(samples, period, count)));
    Ok(skips[0].max(skips[1]).min(most_skipped(count)))
}

/// Half of the periods, but not so many that too few remain.
fn most_skipped(count: usize) -> usize {
    (count / 2).min(count.saturating_sub(MIN_PERIODS))
}

/// Distance of each period from the mean of the second half, as a sum of squares.
fn distances(samples: &[f64], period: usize, count: usize) -> Vec<f64> {
    let periods: Vec<Vec<f64>> = (0..count)
        .map(|p| without_drift(samples, p * period, period))
        .collect();
    let mean = mean_shape(&periods[count / 2..], period);
    let distance = |shape: &Vec<f64>| -> f64 {
        let differences = shape.iter().zip(&mean).map(|(x, m)| x - m);
        let level = differences.clone().sum::<f64>() / period as f64;
        differences.map(|d| (d - level) * (d - level)).sum()
    };
    periods.iter().map(distance).collect()
}

/// The mean of some periods at each sample.
fn mean_shape(periods: &[Vec<f64>], period: usize) -> Vec<f64> {
    let count = periods.len() as f64;
    let sum = |n: usize| periods.iter().map(|shape| shape[n]).sum::<f64>();
    (0..period).map(|n| sum(n) / count).collect()
}

fn leading_unsettled(squares: &[f64]) -> usize {
    let mut settled = squares[squares.len() / 2..].to_vec();
    settled.sort_by(f64::total_cmp);
    let limit = settled[settled.len() / 2] * UNSETTLED_RATIO * UNSETTLED_RATIO;
    squares.iter().take_while(|square| **square > limit).count()
}
