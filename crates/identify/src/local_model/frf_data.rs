//! The response without smoothing: independent data for a parametric fit.
//!
//! The record is divided into blocks of neighbouring bins. The response of a block, `H = sum Y conj(R) / sum U conj(R)` (with
//! the input U itself as instrument R in open loop), is the mean of H over its bins, weighted with U conj(R), for any
//! shape of H. Its variance is `S sum |R|^2 / |sum U conj(R)|^2`, where S, the power of the noise in a bin, follows from the
//! residuals of local rational models. (The residual about a mean would count the top of a resonance as noise, and the fit
//! would trust the data beside the resonance too much.) In the variance, U is without its noise if it has any. A model is
//! compared with the mean of its values at f -+ spread, which has the first three moments of the block: the error is of the
//! fourth order in the ratio of block width to mode width.

use core::ops::RangeInclusive;

use nalgebra::Complex;

use super::noise_floor::NoiseFloor;
use super::record_spectra::RecordSpectra;
use super::spectra::{ExpectedInput, Spectra};
use crate::{EstimatorSettings, FrfDatum, IdentifyError, Signals, band};

/// Width of a block as a ratio of frequency.
const WIDTH_RATIO: f64 = 0.0005;
/// A block counts if the power of its input exceeds that of the noise of the input by this factor: the error of a ratio has no variance
/// where its denominator may be zero. At this factor it is a quarter larger than by the first order.
const MIN_POWER_RATIO: f64 = 10.0;

/// The data of a record that begins and ends at rest, each 0.05 % of its frequency wide and at least one bin; frequencies
/// rise. Blocks without input or without any noise are omitted. Of the settings, only the smallest half-width is used.
///
/// # Errors
/// When the signals, the band or the settings allow no estimate: see [`IdentifyError`].
pub(crate) fn frf_data(
    signals: &Signals,
    band_hz: (f64, f64),
    settings: &EstimatorSettings,
) -> Result<Vec<FrfDatum>, IdentifyError> {
    settings.check()?;
    signals.check()?;
    let bins = band::bins(band_hz, signals.rate_hz, signals.len())?;
    Ok(of_spectra(
        &RecordSpectra::of_signals(signals),
        &bins,
        settings,
    ))
}

/// The data between two bins.
pub(super) fn of_spectra(
    spectra: &impl Spectra,
    bins: &RangeInclusive<usize>,
    settings: &EstimatorSettings,
) -> Vec<FrfDatum> {
    let noise_settings = EstimatorSettings {
        min_half_width_bins: settings.min_half_width_bins,
        ..EstimatorSettings::default()
    };
    let ends = (*bins.start() as f64, *bins.end() as f64);
    let floor = NoiseFloor::new(spectra, ends, &noise_settings);
    let expected = spectra.expected_inputs(bins, &noise_settings);
    let mut data = Vec::new();
    for block in blocks(bins) {
        let of_block = block.start() - bins.start()..=block.end() - bins.start();
        let noise_power = floor.power(middle(&block));
        data.extend(datum(spectra, &block, &expected[of_block], noise_power));
    }
    data
}

fn middle(block: &RangeInclusive<usize>) -> f64 {
    0.5 * (block.start() + block.end()) as f64
}

/// Ranges of neighbouring bins.
fn blocks(bins: &RangeInclusive<usize>) -> Vec<RangeInclusive<usize>> {
    let (mut blocks, mut low) = (Vec::new(), *bins.start());
    while low <= *bins.end() {
        let next = low + (WIDTH_RATIO * low as f64).floor().max(1.0) as usize;
        blocks.push(low..=(next - 1).min(*bins.end()));
        low = next;
    }
    blocks
}

/// The datum of a block with the inputs of its bins without their noise; `None` if the noise of the input is too large.
fn datum(
    spectra: &impl Spectra,
    block: &RangeInclusive<usize>,
    expected: &[ExpectedInput],
    noise_power: f64,
) -> Option<FrfDatum> {
    let input: Complex<f64> = block.clone().map(|k| spectra.input_cross(k)).sum();
    let output: Complex<f64> = block.clone().map(|k| spectra.output_cross(k)).sum();
    let instrument_power: f64 = block.clone().map(|k| spectra.instrument_power(k)).sum();
    let expected_power = expected_power(expected);
    if expected_power < MIN_POWER_RATIO * mean_noise_power(expected) * instrument_power {
        return None;
    }
    let (centre, spread) = moments(spectra, block);
    let datum = FrfDatum {
        frequency_hz: centre * spectra.bin_hz(),
        spread_hz: spread * spectra.bin_hz(),
        response: output / input,
        variance: noise_power * instrument_power / expected_power,
    };
    (is_usable(&datum) && centre.is_finite()).then_some(datum)
}

/// |sum U conj(R)|^2 without the noise of U.
fn expected_power(expected: &[ExpectedInput]) -> f64 {
    let sum: Complex<f64> = expected.iter().map(|input| input.cross).sum();
    sum.norm_sqr()
}

fn mean_noise_power(expected: &[ExpectedInput]) -> f64 {
    let sum: f64 = expected.iter().map(|input| input.noise_power).sum();
    sum / expected.len() as f64
}

fn is_usable(datum: &FrfDatum) -> bool {
    datum.variance > 0.0 && datum.variance.is_finite() && datum.response.norm().is_finite()
}

/// Mean and standard deviation of the bins of a block, weighted with |U conj(R)|.
fn moments(spectra: &impl Spectra, block: &RangeInclusive<usize>) -> (f64, f64) {
    let bins = block.clone();
    let weighted: Vec<(f64, f64)> = bins
        .map(|k| (spectra.input_cross(k).norm(), k as f64))
        .collect();
    let low = *block.start() as f64;
    let centre = low + weighted_mean(&weighted, |bin| bin - low);
    let variance = weighted_mean(&weighted, |bin| (bin - centre) * (bin - centre));
    (centre, variance.sqrt())
}

/// The mean of a function of the bins, each with its weight.
fn weighted_mean(weighted: &[(f64, f64)], value: impl Fn(f64) -> f64) -> f64 {
    let total: f64 = weighted.iter().map(|(weight, _)| weight).sum();
    let terms = weighted.iter().map(|(weight, bin)| weight * value(*bin));
    terms.sum::<f64>() / total
}
