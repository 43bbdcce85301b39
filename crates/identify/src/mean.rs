//! Arithmetic means.

/// The mean of some samples.
pub(super) fn mean(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len() as f64
}

/// The mean of the values around index `k`, up to `reach` to either side.
pub(super) fn mean_around(values: &[f64], k: usize, reach: usize) -> f64 {
    mean(&values[k.saturating_sub(reach)..(k + reach + 1).min(values.len())])
}
