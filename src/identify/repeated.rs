//! Repetitions of one excitation, each of which begins and ends at rest: their mean, tick by tick, is one record of the same
//! signal with less noise.
//!
//! The mean loses nothing, as all have the same input; and unlike their scatter, which takes five of them to say anything, the
//! noise of the mean is seen among its neighbouring bins from two on. A periodic excitation without rest between is for
//! [`super::periodic`].

use super::Signals;

/// The mean of `count` repetitions of so many samples, or of as many as there are whole; a last one that was cut off does not
/// count. Without a whole one the record is left as it is.
pub fn mean(signals: &Signals, length: usize, count: usize) -> Signals {
    let count = count.min(signals.len().checked_div(length).unwrap_or(0));
    let of = |samples: &[f64]| -> Vec<f64> {
        let at = |n: usize| (0..count).map(|r| samples[r * length + n]).sum::<f64>() / count as f64;
        if count == 0 {
            samples.to_vec()
        } else {
            (0..length).map(at).collect()
        }
    };
    Signals {
        rate_hz: signals.rate_hz,
        input_a: of(&signals.input_a),
        output_m: of(&signals.output_m),
    }
}
