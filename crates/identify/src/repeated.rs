//! The mean of repetitions of one excitation, each of which begins and ends at rest.
//!
//! The mean, tick by tick, is one record of the same signal with less noise. No information is lost, as all repetitions have
//! the same input. The noise of the mean is estimated from neighbouring bins, which needs two repetitions; the scatter of the
//! repetitions would need at least five. See [`super::periodic`] for a periodic excitation without rest.

use super::Signals;

/// The mean of `count` repetitions of `length` samples, or of as many whole ones as the record has. A record without a whole
/// repetition is returned unchanged.
pub fn mean(signals: &Signals, length: usize, count: usize) -> Signals {
    let whole = signals.len().checked_div(length).unwrap_or(0);
    let count = count.min(whole);
    if count == 0 {
        return signals.clone();
    }
    Signals {
        rate_hz: signals.rate_hz,
        input: mean_of(&signals.input, length, count),
        output: mean_of(&signals.output, length, count),
    }
}

fn mean_of(samples: &[f64], length: usize, count: usize) -> Vec<f64> {
    (0..length)
        .map(|n| samples[n..].iter().step_by(length).take(count))
        .map(|repetitions| repetitions.sum::<f64>() / count as f64)
        .collect()
}
