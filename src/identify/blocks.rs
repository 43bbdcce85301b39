//! The record cut into blocks of neighbouring bins: what a parametric fit takes, where each datum must be independent of
//! the next and no curve may be smoothed.
//!
//! In a block, `H = sum Y conj(U) / sum |U|^2` is the mean of H over its bins, weighted with |U|^2, whatever the shape of H,
//! with the variance S / sum |U|^2, S being the power of the noise in a bin. A model is compared with it by its mean at
//! f -+ spread, which has the block's first three moments: an error of the fourth order in width over width of a mode.

use nalgebra::Complex;

use super::local::Record;
use super::{EstimatorSettings, IdentifyError, Signals, band};

/// The mean response over a few neighbouring bins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    /// Its centre, weighted with the power of the input, in hertz.
    pub frequency_hz: f64,
    /// Standard deviation of its frequencies about the centre, weighted alike, in hertz.
    pub spread_hz: f64,
    /// Mean of H in metres per ampere.
    pub response: Complex<f64>,
    /// E|error|^2 in (m/A)^2.
    pub variance: f64,
}

/// The blocks of a record that begins and ends at rest, each `settings.resolution_ratio` of its frequency wide and one bin
/// at least; those without input or without any noise are left out. Frequencies rise.
///
/// # Errors
/// Those of [`super::local::estimate`].
pub fn blocks(
    signals: &Signals,
    band_hz: (f64, f64),
    settings: &EstimatorSettings,
) -> Result<Vec<Block>, IdentifyError> {
    settings.check()?;
    signals.check()?;
    let bins = band::bins(band_hz, signals.rate_hz, signals.len())?;
    let record = Record::new(signals, settings, *bins.end());
    let (mut blocks, mut low) = (Vec::new(), *bins.start());
    while low <= *bins.end() {
        let count = (settings.resolution_ratio * low as f64).floor().max(1.0) as usize;
        let high = (low + count - 1).min(*bins.end());
        blocks.extend(block(&record, low, high, settings));
        low = high + 1;
    }
    if blocks.is_empty() {
        Err(IdentifyError::NotExcited { low_hz: band_hz.0, high_hz: band_hz.1 })
    } else {
        Ok(blocks)
    }
}

fn block(record: &Record, low: usize, high: usize, settings: &EstimatorSettings) -> Option<Block> {
    let middle = (low + high) / 2;
    let noise = record.noise_power(middle, settings)?;
    let products = &record.products()[low..=high];
    let sum = |of: &dyn Fn(usize) -> f64| (0..products.len()).map(|j| products[j].uu * of(j)).sum::<f64>();
    let uu = sum(&|_| 1.0);
    let centre = sum(&|j| j as f64) / uu;
    let spread = (sum(&|j| (j as f64 - centre) * (j as f64 - centre)) / uu).sqrt();
    let response = products.iter().map(|p| p.yu).sum::<Complex<f64>>() / uu;
    let variance = noise / uu;
    let block = Block {
        frequency_hz: (low as f64 + centre) * record.bin_hz(),
        spread_hz: spread * record.bin_hz(),
        response,
        variance,
    };
    (variance > 0.0 && variance.is_finite() && response.norm().is_finite()).then_some(block)
}
