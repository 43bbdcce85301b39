//! The record cut into blocks of neighbouring bins: what a parametric fit takes, where each datum must be independent of
//! the next and no curve may be smoothed.
//!
//! In a block, `H = sum Y conj(U) / sum |U|^2` is the mean of H over its bins, weighted with |U|^2, whatever the shape of H,
//! with the variance S / sum |U|^2, S being the power of the noise in a bin, by what rational curves leave around it: an average
//! would take the top of a resonance for noise, and the fit would trust what lies beside it too much. A model is compared with it by its mean at
//! f -+ spread, which has the block's first three moments: an error of the fourth order in width over width of a mode.

use nalgebra::Complex;

use super::error::check_setting;
use super::noise_floor::NoiseFloor;
use super::record::Record;
use super::{EstimatorSettings, IdentifyError, Signals, band};

/// A rational curve, whose residual is the noise, needs so many times the bins that an average would.
const CURVE_WIDER: f64 = 4.0;

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

/// How wide blocks are, and over how many bins their noise is averaged.
#[derive(Clone, Debug, PartialEq)]
pub struct BlockSettings {
    /// Half-width in bins, at least, of the average whose residual is the noise: 2 to 10000.
    pub min_half_width_bins: f64,
    /// Width of a block as a ratio of frequency, and half-width of that average, where it is more: 0 to 0.1.
    pub resolution_ratio: f64,
}

impl Default for BlockSettings {
    fn default() -> Self {
        Self { min_half_width_bins: 4.0, resolution_ratio: 0.0005 }
    }
}

impl BlockSettings {
    pub(super) fn check(&self) -> Result<(), IdentifyError> {
        check_setting("min_half_width_bins", self.min_half_width_bins, 2.0, 1e4)?;
        check_setting("resolution_ratio", self.resolution_ratio, 0.0, 0.1)
    }

    /// The curves whose residual is the noise.
    fn curves(&self) -> EstimatorSettings {
        let default = EstimatorSettings::default();
        EstimatorSettings { min_half_width_bins: CURVE_WIDER * self.min_half_width_bins, ..default }
    }

    /// The first bin after a block.
    pub(super) fn next(&self, bin: usize) -> usize {
        bin + (self.resolution_ratio * bin as f64).floor().max(1.0) as usize
    }

    /// Half-width of the neighbourhood of a bin, in bins.
    pub(super) fn half_width(&self, bin: usize) -> usize {
        self.min_half_width_bins.max(self.resolution_ratio * bin as f64).round() as usize
    }
}

/// The blocks of a record that begins and ends at rest, each `settings.resolution_ratio` of its frequency wide and one bin
/// at least; those without input or without any noise are left out. Frequencies rise.
///
/// # Errors
/// Those of [`super::local::estimate`].
pub fn blocks(signals: &Signals, band_hz: (f64, f64), settings: &BlockSettings) -> Result<Vec<Block>, IdentifyError> {
    settings.check()?;
    signals.check()?;
    let bins = band::bins(band_hz, signals.rate_hz, signals.len())?;
    let record = Record::new(signals);
    let floor = NoiseFloor::of(&record, (*bins.start() as f64, *bins.end() as f64), &settings.curves());
    let (mut blocks, mut low) = (Vec::new(), *bins.start());
    while low <= *bins.end() {
        let high = (settings.next(low) - 1).min(*bins.end());
        blocks.extend(block(&record, low, high, &floor, settings));
        low = high + 1;
    }
    if blocks.is_empty() {
        Err(IdentifyError::NotExcited { low_hz: band_hz.0, high_hz: band_hz.1 })
    } else {
        Ok(blocks)
    }
}

fn block(record: &Record, low: usize, high: usize, floor: &NoiseFloor, settings: &BlockSettings) -> Option<Block> {
    let middle = 0.5 * (low + high) as f64;
    let noise = floor.power(middle, settings.curves().half_width(middle, record.bin_hz));
    let power: Vec<f64> = (low..=high).map(|bin| record.input_power(bin)).collect();
    let sum = |of: &dyn Fn(usize) -> f64| (0..power.len()).map(|j| power[j] * of(j)).sum::<f64>();
    let uu = sum(&|_| 1.0);
    let centre = sum(&|j| j as f64) / uu;
    let spread = (sum(&|j| (j as f64 - centre) * (j as f64 - centre)) / uu).sqrt();
    let response = (low..=high).map(|bin| record.cross(bin)).sum::<Complex<f64>>() / uu;
    let variance = noise / uu;
    let block = Block {
        frequency_hz: (low as f64 + centre) * record.bin_hz,
        spread_hz: spread * record.bin_hz,
        response,
        variance,
    };
    (variance > 0.0 && variance.is_finite() && response.norm().is_finite()).then_some(block)
}
